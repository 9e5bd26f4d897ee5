"""Stills and turntables as arrays and files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from mitex.asset import Asset
from mitex.colour import linear_to_srgb
from mitex.errors import ConfigError
from mitex.export.exr import write_exr
from mitex.images import write_image
from mitex.paths import prepare_output
from mitex.ranges import EXPOSURES
from mitex.render.renderer import OrbitRenderer
from mitex.render.video import check_video, write_video
from mitex.suffixes import STILLS as STILL_SUFFIXES

AZIMUTH, ELEVATION = 25.0, 18.0  # [degrees]


def tone(linear: np.ndarray, exposure: float = 0.0) -> np.ndarray:
    """Linear radiance (..., 3) to display values: sRGB in [0, 1], `exposure` in stops, no film curve.

    Raises:
        ConfigError: the exposure is beyond +-10 stops.
    """
    check_exposure(exposure)
    return linear_to_srgb(np.clip(linear * 2.0**exposure, 0.0, 1.0)).astype(np.float32)


def check_exposure(exposure: float) -> None:
    """Raises a ConfigError if `tone` would refuse an exposure [stops], before anything is rendered."""
    least, most = EXPOSURES
    if not least <= exposure <= most:
        raise ConfigError(f"exposure {exposure:g} is out of range", f"use {least:g} to {most:g} stops")


def still(
    asset: Asset,
    *,
    resolution: int = 512,
    spp: int = 64,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
    displacement: float = 0.0,
    ao: bool = True,
    floating: bool = False,
    seed: int = 0,
) -> np.ndarray:
    """A path-traced picture of an asset.

    Args:
        azimuth: from where the object is seen [degrees]: 0 is its +z side, 90 its +x side.
        elevation: of the camera [degrees], 0 to 85; from -85 if `floating`.
        resolution, displacement, ao, floating: as in `OrbitRenderer`.
        spp, seed: samples per pixel and the seed of their noise.

    Returns:
        (H, W, 3) float32 linear radiance; `tone` makes it displayable.

    Raises:
        ConfigError: an option out of range.
    """
    renderer = OrbitRenderer(
        asset, resolution=resolution, displacement=displacement, ao=ao, floating=floating
    )
    return renderer.render(azimuth, renderer.fit_view(azimuth, elevation), spp, seed)


def render_still(
    asset: Asset, path: str | os.PathLike[str], *, exposure: float = 0.0, **options: Any
) -> Path:
    """Renders `still` and writes it: .png and .jpg in sRGB after `tone`, .exr linear (R, G, B, float16).

    Returns:
        The path written.

    Raises:
        OutputError: unknown suffix or unwritable place, before anything is rendered.
        ConfigError: an option out of range.
    """
    target = prepare_output(path, STILL_SUFFIXES)
    check_exposure(exposure)
    linear = still(asset, **options)
    if target.suffix.lower() == ".exr":
        return write_exr(target, dict(zip("RGB", np.moveaxis(linear, 2, 0) * 2.0**exposure, strict=True)))
    return write_image(target, tone(linear, exposure))


def turntable(
    asset: Asset,
    path: str | os.PathLike[str],
    *,
    frames: int = 72,
    fps: int = 24,
    resolution: int = 384,
    spp: int = 32,
    elevation: float = ELEVATION,
    exposure: float = 0.0,
    displacement: float = 0.0,
    ao: bool = True,
    floating: bool = False,
) -> Path:
    """Renders one full turn of the asset as a video, .mp4 (H.264) or .gif, that loops without a jump.

    How many frames are written is announced: `mitex.progress.listening` calls a function with it.

    Args:
        path: target.
        frames: of one turn, 2 to 3600.
        fps: frames per second, 1 to 60.
        resolution: side [px]; even for .mp4.
        spp, elevation, exposure, displacement, ao, floating: as in `still` and `tone`.

    Returns:
        The path written.

    Raises:
        OutputError: unknown suffix, unwritable place, or the encoder failed.
        ConfigError: an option out of range.
    """
    target = check_video(path, frames, fps, resolution)
    check_exposure(exposure)
    renderer = OrbitRenderer(
        asset, resolution=resolution, displacement=displacement, ao=ao, floating=floating
    )
    angles = AZIMUTH + np.linspace(0.0, 360.0, frames, endpoint=False)
    view = renderer.fit_view(angles.tolist(), elevation)
    # The same seed: noise that stands still compresses better and disturbs less.
    pictures = (tone(renderer.render(float(angle), view, spp), exposure) for angle in angles)
    return write_video(target, pictures, frames, fps, resolution)
