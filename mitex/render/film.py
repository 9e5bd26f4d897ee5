"""Films: one asset after the other before a camera that stays."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from mitex.asset import Asset
from mitex.mesh import Mesh
from mitex.render.picture import AZIMUTH, ELEVATION, tone
from mitex.render.renderer import OrbitRenderer
from mitex.render.video import check_video, write_video


def film(
    assets: Iterable[Asset],
    path: str | os.PathLike[str],
    *,
    frames: int,
    like: Mesh,
    fps: int = 24,
    resolution: int = 384,
    spp: int = 32,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
) -> Path:
    """Renders assets in turn as a video; returns and raises what `turntable` does.

    Args:
        assets: one for each frame; they are made as they are rendered.
        path, fps, resolution: as in `turntable`.
        frames: how many assets there are.
        like: the mesh whose place and size the camera is set for.
        spp, azimuth, elevation: as in `still`.
    """
    target = check_video(path, frames, fps, resolution)

    def pictures() -> Iterator[np.ndarray]:
        view = None
        for asset in assets:
            renderer = OrbitRenderer(asset, resolution=resolution, like=like)
            view = view or renderer.fit_view(azimuth, elevation)
            yield tone(renderer.render(azimuth, view, spp))

    return write_video(target, pictures(), frames, fps, resolution)
