"""`mitex apply`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from mitex.cli.checks import SEEDS, in_range, needless, not_both
from mitex.cli.displacing import TEMPLATE, Displacing
from mitex.errors import ConfigError

if TYPE_CHECKING:
    from mitex.asset import Asset
    from mitex.methods.nerf.use.applied import AppliedTexture

SUFFIXES = (".glb", ".obj", ".ply", ".exr")
PICTURES = (".png", ".jpg", ".jpeg")  # of radiance fields
RESOLUTION = 1024
PICTURE = 512  # side of a picture [pixels]
OPTIONS = {  # those that mean something, by method
    "nca": ("seed", "steps", "subdivide", "orientation", "scale", "resolution", "vertex_colors"),
    "surface": (),
    "geometric": ("seed", "start_level", "end_level", "remesh"),
    "nerf": ("seed", "scale", "size", "density", "lift", "guide", "resolution"),
}


@dataclass
class Apply(Displacing):
    """Put a learned texture on a mesh and write the result.

    The suffix of --out chooses the format: .glb (PBR textures), .obj (with .mtl and PNG maps),
    .ply (vertex colours), .exr (the maps as layers); for radiance fields also .png or .jpg, a picture.

    examples:
      mitex apply runs/pebbles --mesh bunny.obj --out bunny.glb
      mitex apply pebbles --mesh bunny.obj --out bunny.glb --subdivide 2 --resolution 2048
      mitex apply pebbles --mesh scan.ply --out scan.glb --vertex-colors --seed 7 --orientation 45
      mitex apply runs/bunny --mesh bunny.obj --out bunny.glb   (of mitex fit surface: same mesh, no options)
      mitex apply runs/spikes --mesh bunny.obj --out bunny.glb --remesh 2000   (of mitex fit geometric)
      mitex apply runs/durian --mesh bunny.obj --out bunny.png   (of mitex fit nerf; .glb for a mesh)
    """

    model: Annotated[Positional[str], arg(metavar="RUN|MODEL")]
    """Run folder, model file, or name of a bundled model (see `mitex models`)."""

    mesh: Annotated[str, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh; `template`, for geometric
    textures: a variation of their reference."""

    out: Annotated[Path, arg(metavar="ASSET")]
    """File to write."""

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, another variant of the texture."""

    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the model's)")] = None
    """Steps of the automaton."""

    subdivide: Annotated[str, arg(metavar="auto|N")] = "auto"
    """How often to subdivide the mesh, each time to four times the faces; auto: to the training's density."""

    orientation: Annotated[float, arg(metavar="DEG")] = 0.0
    """Turns the texture on the surface [degrees]."""

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the pattern."""

    resolution: Annotated[
        int | None, arg(metavar="N", help_behavior_hint="(default: 1024; of a picture 512)")
    ] = None
    """Side of the baked textures, or of the picture [pixels]."""

    size: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 2048)")] = None
    """Radiance fields: side of the synthesized texture [texels]."""

    density: Annotated[float, arg(metavar="X")] = 1.0
    """Radiance fields: factor of the density; more makes thin parts solid."""

    lift: Annotated[float, arg(metavar="X")] = 1.0
    """Radiance fields: 1 stands the texture on the mesh, 0 carves it in, as it was captured."""

    guide: Annotated[Path | None, arg(metavar="IMAGE", help_behavior_hint="")] = None
    """Radiance fields: a picture over the mesh's UVs that the texture resembles from afar; --scale says how
    small the texture's elements are, and so how fine the picture."""

    vertex_colors: Annotated[bool, arg(help_behavior_hint="")] = False
    """Write colours at the vertices instead of textures."""

    def run(self) -> None:
        self._subdivide()
        in_range("--seed", self.seed, *SEEDS)
        in_range("--steps", self.steps, 1, 10_000)
        in_range("--orientation", self.orientation, -360.0, 360.0)
        in_range("--scale", self.scale, 0.05, 20.0)
        in_range("--resolution", self.resolution, 64, 8192)
        self.check_displacing()
        not_both("--resolution", "--vertex-colors", self.resolution is not None and self.vertex_colors)
        not_both("--size", "--guide", self.size is not None and self.guide is not None)
        in_range("--size", self.size, 128, 8192)
        in_range("--density", self.density, 0.001, 1000.0)
        in_range("--lift", self.lift, 0.0, 1.0)
        from mitex.paths import prepare_output

        method = self._method()
        out = prepare_output(self.out, SUFFIXES + PICTURES * (method == "nerf"))
        suffix = out.suffix.lower()
        if suffix in PICTURES:
            self._captured().render(out, resolution=self.resolution or PICTURE)
            print(self.out)
            return
        needless("--vertex-colors", out, self.vertex_colors and suffix in (".obj", ".exr"))
        bare = suffix == ".ply" or method == "nerf"  # colours at the vertices
        needless("--resolution", out, self.resolution is not None and bare)
        makers = {"surface": self._synthesized, "geometric": self._displaced, "nerf": self._extracted}
        asset = self._grown(suffix) if method == "nca" else makers[method]()
        asset.export(out)
        print(self.out)

    def _method(self) -> str:
        """The method that the model is of; options of others are refused."""
        from mitex.methods.kind import kind

        method = kind(self.model)
        for name in sorted({name for names in OPTIONS.values() for name in names} - {*OPTIONS[method]}):
            if getattr(self, name) != getattr(Apply, name, None):
                option = f"--{name.replace('_', '-')}"
                raise ConfigError(f"{option} means nothing for textures of {method}", f"leave {option} out")
        return method

    def _grown(self, suffix: str) -> Asset:
        """By a cellular automaton, on any mesh."""
        from mitex.mesh import Mesh
        from mitex.methods.nca import NcaTexture

        mesh = Mesh.load(self.mesh)
        textures = suffix != ".ply" and not self.vertex_colors
        resolution = self.resolution or RESOLUTION
        asset = NcaTexture.load(self.model).apply(
            mesh,
            seed=self.seed,
            steps=self.steps,
            subdivide=self._subdivide(),
            orientation=math.radians(self.orientation),
            scale=self.scale,
            resolution=resolution if textures else None,
        )
        return asset.baked(resolution) if textures else asset

    def _synthesized(self) -> Asset:
        """A surface texture on the mesh that it was synthesized on."""
        from mitex.mesh import Mesh
        from mitex.methods.surface import SurfaceTexture

        mesh = Mesh.load(self.mesh)
        return SurfaceTexture.load(self.model).apply(mesh)

    def _displaced(self) -> Asset:
        """By a geometric texture, on any mesh, or on its own template."""
        from mitex.asset import clay
        from mitex.methods.geometric import GeometricTexture

        texture = GeometricTexture.load(self.model)
        if self.mesh == TEMPLATE:
            return clay(texture.generate(self.seed, self.start_level or 0, self.end_level))
        mesh = self.even_mesh(self.mesh)
        made = texture.apply(mesh, seed=self.seed, start_level=self.start_level, end_level=self.end_level)
        self.advise(texture, mesh)
        return made

    def _captured(self) -> AppliedTexture:
        """A radiance field in the shell of any mesh."""
        from mitex.images import read_image
        from mitex.mesh import Mesh
        from mitex.methods.nerf import NerfTexture
        from mitex.methods.nerf.texture import SIZE

        mesh, texture = Mesh.load(self.mesh), NerfTexture.load(self.model)
        guide = None if self.guide is None else read_image(self.guide)
        return texture.apply(
            mesh,
            size=self.size or SIZE,
            seed=self.seed,
            scale=self.scale,
            density=self.density,
            lift=self.lift,
            guide=guide,
        )

    def _extracted(self) -> Asset:
        """What is solid of it, as a mesh."""
        return self._captured().extract()

    def _subdivide(self) -> int | str:
        if self.subdivide == "auto":
            return "auto"
        if self.subdivide not in list("0123456"):
            raise ConfigError(f"--subdivide cannot be {self.subdivide!r}", "use auto or a number from 0 to 6")
        return int(self.subdivide)
