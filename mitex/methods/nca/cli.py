"""The command-line options of MeshNCA."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range, mutually_exclusive, reject_unused
from mitex.methods.nca.growth_options import BakedOptions, oriented
from mitex.methods.nca.ranges import TILE_CELLS
from mitex.methods.option_types import PlainText, VectorField
from mitex.methods.options import DeviceOptions, ReliefOptions
from mitex.methods.words.options import ExemplarOrWordsOptions
from mitex.ranges import SEEDS, TEXELS
from mitex.suffixes import ASSETS, PICTURES
from mitex.training.settings import RunSettings

if TYPE_CHECKING:
    from mitex.asset import Asset

MOST_VARIANTS = 32
PAGE = ".html"


@dataclass(kw_only=True)
class Fit(DeviceOptions, ExemplarOrWordsOptions):
    """Learn a texture from an image, a set of PBR maps, or words with a neural cellular automaton (MeshNCA).

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture; Ctrl-C
    saves, and --resume goes on.

    examples:
      mitex fit nca --exemplar pebbles.png --out runs/pebbles
      mitex fit nca --exemplar cobblestone --steps 300 --set hidden=96
      mitex fit nca --exemplar maps/ --preset paper --out runs/paper
      mitex fit nca --exemplar lava --init lava --motion right --out runs/flowing
      mitex fit nca --text "red bricks" --out runs/red-bricks
      mitex fit nca --text "green moss" --mesh vase --clip models/clip-b32
      mitex fit nca --exemplar pebbles.png --out runs/pebbles --resume
      mitex fit nca --settings --preset paper
    """

    only_at_start: ClassVar[frozenset[str]] = frozenset({"init"})

    text: Annotated[PlainText | None, arg(metavar="WORDS", help_behavior_hint="")] = None
    """In place of an exemplar: what the texture is made of. It gets colours and a relief."""

    mesh: Annotated[str | None, arg(metavar="MESH|NAME", help_behavior_hint="(default: spheres)")] = None
    """With --text: train on this mesh."""

    preset: Annotated[PlainText | None, arg(metavar="NAME", help_behavior_hint="(default: patch)")] = None
    """Settings to start from: `patch` is fast, `paper` follows the publication; `motion` (the default with
    --motion) and `motion-paper` likewise, for textures that move; `text`, `text-words` (the default with the
    small embedded model) and `text-paper`, for those from words."""

    init: Annotated[str | None, arg(metavar="RUN|MODEL", help_behavior_hint="")] = None
    """Start from the weights of a model or a run; of the still texture, for one that shall move. The preset
    `text` starts from a model in any case."""

    motion: Annotated[VectorField | None, arg(metavar="FIELD", help_behavior_hint="")] = None
    """Vector field that the texture learns to move along, by name (right, up, about-y ...) or direction."""

    def run(self) -> None:
        mutually_exclusive("--resume", "--init", self.resume and self.init is not None)
        self.check_source()
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        print(self.fit(options))

    def check_source(self) -> None:
        super().check_source()
        mutually_exclusive("--text", "--exemplar", self.text is not None and self.exemplar is not None)
        if self.mesh is not None and self.text is None:
            raise ConfigError("--mesh means nothing without --text", "leave it out")

    def fit_exemplar(self, options: RunSettings) -> Path:
        from mitex.exemplar import Exemplar

        exemplar = Exemplar.load(str(self.exemplar))
        out = self.folder(exemplar.name)
        from mitex.methods import nca

        with self.progress() as on_step:
            nca.fit(exemplar, out, init=self.init, motion=self.motion, on_step=on_step, **options)
        return out

    def fit_text(self, text: str, options: RunSettings) -> Path:
        from mitex.mesh import Mesh
        from mitex.methods import nca

        out = self.words_folder(text)
        mesh = None if self.mesh is None else Mesh.load(self.mesh)
        with self.progress() as on_step:
            nca.fit_text(
                text,
                out,
                mesh=mesh,
                clip=self.clip,
                init=self.init,
                motion=self.motion,
                on_step=on_step,
                **options,
            )
        return out


@dataclass(kw_only=True)
class Apply(BakedOptions, ReliefOptions):
    """Grow a cellular automaton's texture on a mesh, or on a square that repeats (--tile).

    examples:
      mitex apply runs/pebbles --mesh bunny.obj --out bunny.glb
      mitex apply pebbles --mesh bunny.obj --out bunny.glb --subdivide 2 --resolution 2048
      mitex apply pebbles --mesh scan.ply --out scan.glb --vertex-colours --seed 7 --orientation 45
      mitex apply pebbles --mesh bunny.obj --out bunny.glb --variants 5
      mitex apply pebbles --mesh bunny.obj --out bunny.html --looks lava,knit
      mitex apply pebbles --mesh bunny.obj --out maps/ --maps-format exr
      mitex apply pebbles --tile 1024 --out pebbles-tile
    """

    exemplar_width: Annotated[float | None, arg(metavar="X", help_behavior_hint="")] = None
    """In place of --scale: width of the exemplar, as large as on a surface texture at 0.5 [sides of the UV
    layout's square]."""

    looks: Annotated[str | None, arg(metavar="MODEL,...", help_behavior_hint="")] = None
    """Further textures that a page (.html) offers, and grafts if they are of the same family."""

    keep_dense: Annotated[bool, arg(help_behavior_hint="")] = False
    """Write the subdivided, rounded mesh instead of the given one."""

    displace: Annotated[bool, arg(help_behavior_hint="")] = False
    """Move the vertices by the relief of a texture from words; best with --keep-dense."""

    variants: Annotated[int, arg(metavar="N")] = 1
    """Looks that a .glb offers on the one mesh, each with the next seed (KHR_materials_variants)."""

    tile: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None
    """In place of a mesh: write maps of N x N pixels that repeat without a seam to the folder --out."""

    tile_cells: Annotated[
        int | None, arg(metavar="N", help_behavior_hint="(default: the exemplar about twice)")
    ] = None
    """Cells along a side of the tile; more make the pattern finer."""

    def check(self) -> None:
        super().check()
        self.check_growth()
        in_range("--variants", self.variants, 1, MOST_VARIANTS)
        in_range("--seed", self.seed + self.variants - 1, *SEEDS)
        in_range("--exemplar-width", self.exemplar_width, 1e-3, 100.0)
        mutually_exclusive("--exemplar-width", "--scale", self.exemplar_width is not None and self.scale != 1)
        mutually_exclusive("--variants", "--vertex-colours", self.variants > 1 and self.vertex_colours)
        for option, used in {
            "--variants": self.variants > 1,
            "--vertex-colours": self.vertex_colours,
        }.items():
            mutually_exclusive("--relief", option, self.relief is not None and used)
        self._check_tile()

    def _check_tile(self) -> None:
        if self.tile is None:
            if self.mesh is None:
                raise ConfigError("--mesh is missing", "give --mesh MESH, or --tile N for maps that repeat")
            if self.tile_cells is not None:
                raise ConfigError("--tile-cells means nothing without --tile", "give both or neither")
            return
        in_range("--tile", self.tile, *TEXELS)
        in_range("--tile-cells", self.tile_cells, *TILE_CELLS)
        others = {
            "--mesh": self.mesh is not None,
            "--subdivide": self.subdivide != "auto",
            "--orientation": oriented(self.orientation) != 0,
            "--scale": self.scale != 1,
            "--exemplar-width": self.exemplar_width is not None,
            "--resolution": self.resolution is not None,
            "--vertex-colours": self.vertex_colours,
            "--keep-dense": self.keep_dense,
            "--displace": self.displace,
            "--relief": self.relief is not None,
            "--variants": self.variants > 1,
            "--looks": self.looks is not None,
        }
        for option, used in others.items():
            mutually_exclusive("--tile", option, used)
        place = Path(self.out)
        reject_unused("--tile", place, place.suffix.lower() in ASSETS + PICTURES)

    def inputs(self) -> list[Path | str]:
        return [*super().inputs(), *self._looks, *self.growth_files()]

    def output_path(self) -> Path:
        if self.tile is None:
            return super().output_path()
        from mitex.export import check_folder
        from mitex.paths import expanded

        return check_folder(expanded(self.out), self.maps_format, self.inputs(), mesh=False)

    def check_output(self, out: Path) -> None:
        suffix = out.suffix.lower()
        if self.tile is None:
            coloured = suffix in (".glb", ".ply", *PICTURES)
            reject_unused("--vertex-colours", out, self.vertex_colours and not coloured)
            reject_unused("--resolution", out, self.resolution is not None and suffix == ".ply")
            reject_unused("--variants", out, self.variants > 1 and suffix != ".glb")
            page = suffix == PAGE
            reject_unused("--looks", out, not page and self.looks is not None)
            reject_unused("--resolution", out, page and self.resolution is not None)
            reject_unused("--keep-dense", out, page and self.keep_dense)
            reject_unused("--displace", out, page and self.displace)
            reject_unused("--relief", out, page and self.relief is not None)

    def write(self, out: Path) -> None:
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.export import write_maps, write_variants
        from mitex.methods.nca import NcaTexture

        if self.tile is not None:
            texture = NcaTexture.load(self.model)
            motion = {"field": self.field, "speed": self.speed}
            maps = texture.tile(self.tile, cells=self.tile_cells, seed=self.seed, steps=self.steps, **motion)
            write_maps(maps, out, self.maps_format)
        elif self.variants > 1:
            from mitex.mesh import Mesh

            seeds = range(self.seed, self.seed + self.variants)
            options = self._options(out)
            assets = NcaTexture.load(self.model).variants(Mesh.load(self._mesh), seeds, **options)
            write_variants(assets, out)
        elif out.suffix.lower() == PAGE:
            self._write_page(out)
        else:
            super().write(out)

    def _write_page(self, out: Path) -> None:
        from mitex.mesh import Mesh
        from mitex.methods.nca import NcaTexture, living_page

        living_page(
            NcaTexture.load(self.model),
            Mesh.load(self._mesh),
            out,
            looks=[NcaTexture.load(model) for model in self._looks],
            seed=self.seed,
            steps=self.steps,
            **self.growth(),
        )

    def applied(self, out: Path) -> Asset:
        from mitex.mesh import Mesh
        from mitex.methods.nca import NcaTexture

        texture, mesh = NcaTexture.load(self.model), Mesh.load(self._mesh)
        return texture.apply(mesh, seed=self.seed, **self._options(out))

    @property
    def _looks(self) -> list[str]:
        return [] if self.looks is None else self.looks.split(",")

    @property
    def _mesh(self) -> str:
        assert self.mesh is not None
        return self.mesh

    def _options(self, out: Path) -> dict[str, Any]:
        """Options of `NcaTexture.apply` but the seed."""
        own = ("exemplar_width", "keep_dense", "displace")
        return self.baked(out.suffix.lower()) | {name: getattr(self, name) for name in own}
