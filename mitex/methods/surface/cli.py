"""The command-line options of surface textures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tyro.conf import arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range, mutually_exclusive
from mitex.methods.option_types import PlainText, VectorField
from mitex.methods.options import ReliefOptions
from mitex.methods.words.options import ExemplarOrWordsOptions
from mitex.ranges import SCALES
from mitex.training.settings import RunSettings

if TYPE_CHECKING:
    from mitex.asset import Asset

TILE_SIDES = (32, 4096)  # of a tile [px]


@dataclass(kw_only=True)
class Fit(ExemplarOrWordsOptions):
    """Synthesize a texture directly on one mesh, without views and without seams (tangent-space CNN), or on a
    flat square that repeats (--tile): from an exemplar, from words, or from both.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit surface --exemplar pebbles.png --mesh bunny.obj --out runs/bunny
      mitex fit surface --exemplar scales --mesh octopus --resolution 1024 --scale 0.5
      mitex fit surface --exemplar maps/ --mesh bunny.obj --preset paper --out runs/paper
      mitex fit surface --exemplar painting.png --mesh bunny.obj --content ao --out runs/painted
      mitex fit surface --text "blue and white stripes" --mesh vase --out runs/stripes
      mitex fit surface --exemplar bark.png --mesh tree.obj --orientation along.npy --out runs/tree
      mitex fit surface --exemplar pebbles.png --mesh bunny.obj --out runs/bunny --resume
      mitex fit surface --exemplar maps/ --tile 1024 --out runs/tile
    """

    fits_to_mesh: ClassVar[bool] = True

    text: Annotated[PlainText | None, arg(metavar="WORDS", help_behavior_hint="")] = None
    """What the mesh is made of: in place of an exemplar, or beside one."""

    mesh: Annotated[str | None, arg(metavar="MESH|NAME", help_behavior_hint="")] = None
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh."""

    tile: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None
    """In place of a mesh: a texture of N x N pixels that repeats without a seam."""

    preset: Annotated[PlainText | None, arg(metavar="NAME", help_behavior_hint="(default: fast)")] = None
    """Settings to start from: `fast` begins with patches of the exemplar, `noise` with noise, `paper` follows
    the publication, `style` goes with --content; `text` and `text-words` (the default with the small
    embedded model) are for words."""

    resolution: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the preset's)")] = None
    """Side of the texture [texels]."""

    content: Annotated[Literal["ao"] | str | None, arg(metavar="IMAGE|ao", help_behavior_hint="")] = None
    """Style transfer: keep the structure of this texture (on the mesh's own UVs), or of ambient occlusion."""

    orientation: Annotated[VectorField | None, arg(metavar="FIELD", help_behavior_hint="")] = None
    """Vector field that the exemplar's up follows: a name (up, right, about-y, ...), a direction, or a file
    (.npy .ply .json). For one angle everywhere: --set angle=DEG."""

    scale: Annotated[float | None, arg(metavar="X", help_behavior_hint="(default: the preset's)")] = None
    """Size of the pattern; with --keep-uvs it follows their layout."""

    scale_map: Annotated[Path | None, arg(metavar="IMAGE|FILE", help_behavior_hint="")] = None
    """Where the pattern's size varies: a picture over the mesh's own UVs, white as large as --scale says,
    middle grey half as large, and the darkest that is allowed, 64, a quarter; or a factor from 0.25 to 4 for
    each vertex (.npy), which can make it larger, too."""

    keep_uvs: Annotated[bool, arg(help_behavior_hint="")] = False
    """Use the mesh's own UVs, which must not overlap."""

    def run(self) -> None:
        self.check_source()
        self._check_tile()
        options = self.run_options(resolution=self.tile or self.resolution, scale=self.scale)
        print(self.fit(options))

    def fit_exemplar(self, options: RunSettings) -> Path:
        from mitex.exemplar import Exemplar
        from mitex.mesh import Mesh

        exemplar, mesh = Exemplar.load(str(self.exemplar)), Mesh.load(self.mesh) if self.mesh else None
        out = self.folder(f"{exemplar.name}-{'tile' if mesh is None else mesh.name}")
        from mitex.methods import surface

        with self.progress() as on_step:
            surface.fit(exemplar, mesh, out, on_step=on_step, **self._on_mesh(), **options)
        return out

    def fit_text(self, text: str, options: RunSettings) -> Path:
        from mitex.exemplar import Exemplar
        from mitex.mesh import Mesh

        exemplar, mesh = Exemplar.load(self.exemplar) if self.exemplar else None, Mesh.load(str(self.mesh))
        out = self.words_folder(text, mesh.name)
        from mitex.methods import surface

        with self.progress() as on_step:
            surface.fit_text(
                text,
                mesh,
                out,
                exemplar=exemplar,
                clip=self.clip,
                on_step=on_step,
                **self._on_mesh(),
                **options,
            )
        return out

    def _on_mesh(self) -> dict[str, Any]:
        """How the texture lies on the mesh."""
        return {
            "keep_uvs": self.keep_uvs,
            "content": self.content,
            "orientation": self.orientation,
            "scale_map": self.scale_map,
        }

    def check_source(self) -> None:
        super().check_source()
        mutually_exclusive("--tile", "--text", self.tile is not None and self.text is not None)
        for option, value in (("--orientation", self.orientation), ("--scale-map", self.scale_map)):
            if value is not None and self.exemplar is None:
                raise ConfigError(f"{option} means nothing without --exemplar", "leave it out")

    def _check_tile(self) -> None:
        in_range("--tile", self.tile, *TILE_SIDES)
        in_range("--scale", self.scale, *SCALES)
        if self.mesh is None and self.tile is None:
            raise ConfigError("--mesh is missing", "give --mesh MESH, or --tile N for a texture that repeats")
        others = {
            "--mesh": self.mesh is not None,
            "--resolution": self.resolution is not None,
            "--content": self.content is not None,
            "--orientation": self.orientation is not None,
            "--scale-map": self.scale_map is not None,
            "--keep-uvs": self.keep_uvs,
        }
        for option, used in others.items():
            mutually_exclusive("--tile", option, self.tile is not None and used)


@dataclass(kw_only=True)
class Apply(ReliefOptions):
    """Write a surface texture on the mesh that it was synthesized on, which is kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/bunny --out bunny.glb
      mitex apply runs/bunny --out print.glb --relief 0.05
      mitex apply runs/tile --out tile/
    """

    def applied(self, out: Path) -> Asset:
        from mitex.mesh import Mesh
        from mitex.methods.surface import SurfaceTexture

        mesh = None if self.mesh is None else Mesh.load(self.mesh)
        return SurfaceTexture.load(self.model).apply(mesh)
