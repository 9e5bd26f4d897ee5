"""A texture as the gallery shows it."""

from __future__ import annotations

from math import log

from mitex.asset import Asset
from mitex.mesh import torus
from mitex.methods.geometric.texture import GeometricTexture

# Vertices around and across: few, since growth splits the faces of most.
RINGS = ((24, 10), (48, 20), (96, 40), (160, 64))


def on_ring(texture: GeometricTexture) -> Asset:
    """On the ring beside which its features are most nearly as large as beside the reference."""
    rings = [torus(*size) for size in RINGS]
    return texture.apply(min(rings, key=lambda ring: abs(log(texture.relative_size(ring)[0]))))
