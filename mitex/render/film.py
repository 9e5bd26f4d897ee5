"""Films: one asset after the other before a camera that stays."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path

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
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Renders assets in turn as a video, .mp4 (H.264) or .gif.

    Args:
        assets: one for each frame; they are made as they are rendered.
        path: target.
        frames: how many there are.
        like: the mesh whose place and size the camera is set for.
        fps, resolution, spp, azimuth, elevation, progress: as in `turntable` and `still`.

    Returns:
        The path written.

    Raises:
        OutputError: unknown suffix, unwritable place, or the encoder failed.
        ConfigError: an option out of range.
    """
    target = check_video(path, frames, fps, resolution)

    def pictures():
        view = None
        for k, asset in enumerate(assets):
            renderer = OrbitRenderer(asset, resolution=resolution, like=like)
            view = view or renderer.frame(azimuth, elevation)
            yield tone(renderer.render(azimuth, view, spp))
            if progress:
                progress(k + 1, frames)

    return write_video(target, pictures(), fps, resolution)
