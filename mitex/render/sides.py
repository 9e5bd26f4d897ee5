"""An object from all sides."""

from __future__ import annotations

import numpy as np

from mitex.asset import Asset
from mitex.progress import announce
from mitex.render.picture import tone
from mitex.render.renderer import OrbitRenderer

AZIMUTHS = tuple(range(0, 360, 45))  # [degrees]
ELEVATIONS = (-30.0, 0.0, 30.0)


def sides(asset: Asset, resolution: int, spp: int = 32) -> np.ndarray:
    """Pictures of an asset before plain white, from `AZIMUTHS` at each of `ELEVATIONS`.

    Args:
        asset: what is shown.
        resolution: side of a picture [px].
        spp: samples per pixel.

    Returns:
        (24, resolution, resolution, 3) float32 sRGB in [0, 1].

    Raises:
        ConfigError: an option out of range.
    """
    renderer = OrbitRenderer(asset, resolution=resolution, floating=True)
    pictures = []
    for elevation in ELEVATIONS:
        view = renderer.fit_view(AZIMUTHS, elevation)
        for azimuth in AZIMUTHS:
            announce("rendering", len(pictures), len(AZIMUTHS) * len(ELEVATIONS))
            pictures.append(tone(renderer.render(azimuth, view, spp)))
    return np.stack(pictures)
