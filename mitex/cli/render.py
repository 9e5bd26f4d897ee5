"""`mitex render`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from mitex.methods.checks import in_range, reject_unused
from mitex.ranges import DISPLACEMENTS, EXPOSURES, FRAME_RATES, FRAMES, PIXELS, SAMPLES, TURNS, elevations
from mitex.suffixes import STILLS, VIDEOS


@dataclass
class Render:
    """Path-trace an asset that `mitex apply` wrote: a still (.png .jpg .exr) or a turntable (.mp4 .gif).

    examples:
      mitex render bunny.glb --out bunny.png
      mitex render bunny.glb --out bunny.exr --resolution 1024 --spp 256 --azimuth 30 --elevation 15
      mitex render bunny.glb --out bunny.mp4 --frames 120 --displacement 0.02
    """

    asset: Annotated[Positional[str], arg(metavar="ASSET")]
    """File written by `mitex apply` (.glb .obj .ply)."""

    out: Annotated[Path, arg(metavar="FILE")]
    """Image or movie to write."""

    resolution: Annotated[
        int | None, arg(metavar="N", help_behavior_hint="(default: 512; turntables 384)")
    ] = None
    """Width and height [pixels]."""

    spp: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 64; turntables 32)")] = None
    """Samples a pixel."""

    azimuth: Annotated[float | None, arg(metavar="DEG", help_behavior_hint="(default: 25)")] = None
    """Side from which a still shows the object [degrees]; 0 is +z, 90 is +x."""

    elevation: Annotated[float | None, arg(metavar="DEG", help_behavior_hint="(default: 18)")] = None
    """How high the camera stands [degrees]."""

    displacement: Annotated[float, arg(metavar="X")] = 0.0
    """Moves the surface by the squared height map, this far at most [radii of the mesh]."""

    exposure: Annotated[float, arg(metavar="STOPS")] = 0.0
    """Brightens or darkens the picture."""

    floating: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show the object before plain white instead of standing on paper; elevations down to -85 then."""

    frames: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 72)")] = None
    """Frames of a turntable."""

    fps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 24)")] = None
    """Frames a second of a turntable."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        self._check_ranges()
        from mitex.mesh.files import mesh_files
        from mitex.paths import prepare_output

        out = prepare_output(self.out, STILLS + VIDEOS, inputs=mesh_files(self.asset))
        moving = out.suffix.lower() in VIDEOS
        reject_unused("--frames", out, not moving and self.frames is not None)
        reject_unused("--fps", out, not moving and self.fps is not None)
        reject_unused("--azimuth", out, moving and self.azimuth is not None)
        options = self._options()
        if moving:
            from mitex.render import check_video

            # The defaults are possible.
            check_video(out, self.frames or 2, self.fps or 1, self.resolution or 16)
        from mitex.asset import Asset

        asset = Asset.load(self.asset)
        if moving:
            from mitex.render import turntable

            turntable(asset, out, **options)
        else:
            asset.render(out, **options)
        print(self.out)

    def _check_ranges(self) -> None:
        in_range("--resolution", self.resolution, *PIXELS)
        in_range("--spp", self.spp, *SAMPLES)
        in_range("--azimuth", self.azimuth, *TURNS)
        in_range("--elevation", self.elevation, *elevations(self.floating))
        in_range("--displacement", self.displacement, *DISPLACEMENTS)
        in_range("--exposure", self.exposure, *EXPOSURES)
        in_range("--frames", self.frames, *FRAMES)
        in_range("--fps", self.fps, *FRAME_RATES)

    def _options(self) -> dict[str, Any]:
        """Keyword arguments of `still` and `turntable`; what was not given is left to their defaults."""
        return {
            name: value
            for name, value in vars(self).items()
            if name not in ("asset", "out", "quiet") and value is not None
        }
