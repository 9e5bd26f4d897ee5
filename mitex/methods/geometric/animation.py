"""`mitex animate` for geometric textures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from mitex.methods.checks import in_range
from mitex.methods.geometric.cli import TEMPLATE, GrowthOptions
from mitex.methods.options import field_files
from mitex.ranges import FRAME_RATES, FRAMES, PIXELS, SAMPLES, SEEDS
from mitex.suffixes import VIDEOS

if TYPE_CHECKING:
    import numpy as np

    from mitex.mesh import Mesh
    from mitex.methods.geometric import GeometricTexture


@dataclass(kw_only=True)
class Animate(GrowthOptions):
    """Film a geometric texture: as it grows on a mesh, or as one variant becomes another.

    examples:
      mitex animate runs/spikes --mesh bunny.obj --out growth.mp4 --remesh 1000
      mitex animate runs/spikes --mesh bunny.obj --out change.mp4 --to-seed 7 --frames 48
      mitex animate runs/spikes --mesh template --out growth.gif --meshes frames
    """

    model: Annotated[Positional[str], arg(metavar="RUN")]
    """Run folder of mitex fit geometric."""

    mesh: Annotated[str, arg(metavar="MESH|template")]
    """Mesh file or embedded mesh; `template`: the mesh that the training started from."""

    out: Annotated[Path, arg(metavar="FILE")]
    """Video to write (.mp4 .gif)."""

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed."""

    to_seed: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None
    """Show the way to this seed's variant, in place of the growth."""

    frames: Annotated[int, arg(metavar="N")] = 36
    """Frames: of each level's growth, or of the way from seed to seed."""

    meshes: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="")] = None
    """Write the mesh of each frame there too, as 0000.ply and so on."""

    resolution: Annotated[int, arg(metavar="N")] = 384
    """Width and height [pixels]."""

    spp: Annotated[int, arg(metavar="N")] = 32
    """Samples a pixel."""

    fps: Annotated[int, arg(metavar="N")] = 24
    """Frames a second."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        self.check_growth(self.mesh)
        in_range("--seed", self.seed, *SEEDS)
        in_range("--to-seed", self.to_seed, *SEEDS)
        in_range("--frames", self.frames, *FRAMES)
        in_range("--resolution", self.resolution, *PIXELS)
        in_range("--spp", self.spp, *SAMPLES)
        in_range("--fps", self.fps, *FRAME_RATES)
        from mitex.mesh.files import mesh_files
        from mitex.paths import check_writable, prepare_folder, prepare_output
        from mitex.render import check_video, film

        inputs = [self.model, *mesh_files(self.mesh), *field_files(self.field)]
        out = prepare_output(self.out, VIDEOS, inputs)
        check_video(out, self.frames, self.fps, self.resolution)
        if self.meshes is not None:
            check_writable(self.meshes)
        from mitex.asset import clay
        from mitex.methods.geometric import GeometricTexture

        texture = GeometricTexture.load(self.model)
        if self.mesh == TEMPLATE:
            mesh, field, start = texture.template, None, self.start_level or 0
        else:
            (mesh, field), start = self.even_mesh(texture, self.mesh), self.start_level
        meshes = list(self._sequence(texture, mesh, field, start))
        check_video(out, len(meshes), self.fps, self.resolution)
        if self.meshes is not None:
            folder = prepare_folder(self.meshes)
            places = [prepare_output(folder / f"{k:04}.ply", inputs=inputs) for k in range(len(meshes))]
            for place, frame in zip(places, meshes, strict=True):
                clay(frame).export(place)
        film(
            map(clay, meshes),
            out,
            frames=len(meshes),
            like=meshes[-1],
            fps=self.fps,
            resolution=self.resolution,
            spp=self.spp,
        )
        if self.mesh != TEMPLATE:
            self.advise(texture, mesh)
        print(self.out)

    def _sequence(
        self, texture: GeometricTexture, mesh: Mesh, field: np.ndarray | None, start: int | None
    ) -> Iterator[Mesh]:
        if self.to_seed is None:
            frames = partial(texture.growth, mesh, self.frames, seed=self.seed)
        else:
            frames = partial(texture.interpolate, mesh, (self.seed, self.to_seed), self.frames)
        return frames(start_level=start, end_level=self.end_level, field=field, placement=self.placement)
