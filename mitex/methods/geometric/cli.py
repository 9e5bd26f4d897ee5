"""The command-line options of geometric textures."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range, mutually_exclusive
from mitex.methods.geometric.config import MAX_LEVELS, Placement, ReferenceName
from mitex.methods.option_types import PlainText, VectorField
from mitex.methods.options import DeviceOptions, MeshOptions, field_files
from mitex.ranges import EVEN_VERTICES, SEEDS

if TYPE_CHECKING:
    import numpy as np

    from mitex.asset import Asset
    from mitex.mesh import Mesh
    from mitex.methods.geometric import GeometricTexture

TEMPLATE = "template"  # as a mesh: the one that the texture's training started from


@dataclass(kw_only=True)
class Fit(DeviceOptions):
    """Learn the geometric texture of one mesh with a hierarchy of face-convolution GANs.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --mesh MESH --out ASSET` grows it on any mesh. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit geometric --reference spikes
      mitex fit geometric --reference craters --preset finest
      mitex fit geometric --reference cactus.obj --out runs/cactus
      mitex fit geometric --reference bricks --field about-y --preset finest --set symmetric=true
      mitex fit geometric --reference ring.obj --template coarse-ring.obj --preset paper
      mitex fit geometric --reference cactus.obj --out runs/cactus --resume --steps 12000   (one more level)
    """

    reference: Annotated[ReferenceName, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or a reference by formula: spikes, scales, knobs, ridges,
    craters, warts, cactus, shingles, bricks, woven."""

    preset: Annotated[
        PlainText | None, arg(metavar="fast|paper|fine|finest", help_behavior_hint="(default: fast)")
    ] = None
    """Settings to start from: `fast`; `paper`, which follows the publication; `fine`, for features too small
    for coarse levels, such as knobs and ridges; or `finest`, for craters, strands, bricks and shingles."""

    template: Annotated[str | None, arg(metavar="MESH", help_behavior_hint="(default: by genus)")] = None
    """Coarse mesh of the reference's topology from which its training meshes are made."""

    field: Annotated[VectorField | None, arg(metavar="FIELD", help_behavior_hint="")] = None
    """Vector field on the reference that its relief follows: a name (up, about-y ...), a direction, or a file
    (.npy .ply .json)."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.methods import geometric
        from mitex.methods.geometric.references import find_reference

        reference = find_reference(self.reference)
        out = self.folder(reference.name)
        with self.progress() as on_step:
            geometric.fit(
                reference, out, template=self.template, field=self.field, on_step=on_step, **options
            )
        print(out)


@dataclass(kw_only=True)
class GrowthOptions:
    """How a geometric texture grows on a mesh."""

    start_level: Annotated[
        int | None, arg(metavar="N", help_behavior_hint="(default: 2, of `fine` and `finest` 0)")
    ] = None
    """The generator to begin with; low ones change the shape. With --mesh template (default: 0), `apply`
    rebuilds the levels below it without noise, and `animate` leaves them out."""

    end_level: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the last)")] = None
    """The last generator; each one after the first splits every face in four."""

    remesh: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None
    """Give the mesh N even vertices first; fewer make the texture larger."""

    field: Annotated[VectorField | None, arg(metavar="FIELD", help_behavior_hint="")] = None
    """Vector field on the mesh that a relief with a direction follows: a name (up, about-y ...), a direction,
    or a file (.npy .ply .json)."""

    placement: Annotated[Placement, arg(metavar="even|none")] = "even"
    """Spread bumps and dents that are larger than a triangle evenly, as densely as on the reference, and draw
    back dents that would meet in thin walls; or leave that to the generators, as published."""

    def check_growth(self, mesh: str) -> None:
        """Refuses levels out of range, and what means nothing for the template.

        Raises:
            ConfigError: there is such an option.
        """
        in_range("--start-level", self.start_level, 0, MAX_LEVELS - 1)
        in_range("--end-level", self.end_level, 0, MAX_LEVELS - 1)
        in_range("--remesh", self.remesh, *EVEN_VERTICES)
        for option, given in (("--field", self.field), ("--remesh", self.remesh)):
            mutually_exclusive("--mesh template", option, mesh == TEMPLATE and given is not None)
        mutually_exclusive(
            "--mesh template", "--placement none", mesh == TEMPLATE and self.placement == "none"
        )

    def even_mesh(self, texture: GeometricTexture, name: str) -> tuple[Mesh, np.ndarray | None]:
        """The mesh to be displaced, remeshed if that is asked for, and the field on it.

        Raises:
            ConfigError, MeshError: there is none; or, before the mesh is remeshed, what `check` refuses.
        """
        from mitex.mesh import Mesh, remesh
        from mitex.mesh.fields import carried_field, vector_field

        given = Mesh.load(name)
        faces = len(given.faces) if self.remesh is None else 2 * self.remesh
        texture.check(given.name, faces, self.start_level, self.end_level, self.field)
        if self.field is not None:
            vector_field(given, self.field)
        mesh = given if self.remesh is None else remesh(given, self.remesh)
        return mesh, None if self.field is None else carried_field(given, mesh, self.field)

    def advise(self, texture: GeometricTexture, mesh: Mesh) -> None:
        """Says, on stderr, how large the texture is on a mesh, and what would change that."""
        size, vertices = texture.relative_size(mesh, self.start_level, self.end_level)
        print(
            f"features are {size:.2g} times as large as on the reference, beside the whole mesh; "
            f"--remesh {vertices} makes them as large",
            file=sys.stderr,
        )


@dataclass(kw_only=True)
class Apply(GrowthOptions, MeshOptions):
    """Grow a geometric texture on a mesh, or on its own template: --mesh template.

    examples:
      mitex apply runs/spikes --mesh bunny.obj --out bunny.glb --remesh 2000
      mitex apply runs/cactus --mesh bunny.obj --out bunny.glb --remesh 2000 --field up
      mitex apply spikes --mesh template --out variation.glb --seed 7
    """

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, another variant of the texture."""

    untangle: Annotated[bool, arg(help_behavior_hint="")] = False
    """Draw the relief back where the surface would pierce itself, as on thin limbs, and say how many pairs of
    faces did and do."""

    def check(self) -> None:
        self.check_growth(self.mesh)
        in_range("--seed", self.seed, *SEEDS)
        if self.untangle and self.mesh == TEMPLATE:
            raise ConfigError(
                "--untangle draws back towards the mesh, and a template lies too deep", "leave it out"
            )

    def inputs(self) -> list[Path | str]:
        return [*super().inputs(), *field_files(self.field)]

    def applied(self, out: Path) -> Asset:
        from mitex.asset import clay
        from mitex.methods.geometric import GeometricTexture

        texture = GeometricTexture.load(self.model)
        if self.mesh == TEMPLATE:
            return clay(texture.generate(self.seed, self.start_level or 0, self.end_level))
        mesh, field = self.even_mesh(texture, self.mesh)
        asset = texture.apply(
            mesh,
            seed=self.seed,
            start_level=self.start_level,
            end_level=self.end_level,
            untangle=self.untangle,
            field=field,
            placement=self.placement,
        )
        self.advise(texture, mesh)
        return asset
