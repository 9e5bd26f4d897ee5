"""`GatysTexture`: the picture that was optimized."""

from mitex.methods.baselines.gatys import METHOD
from mitex.methods.planar import PlanarTexture


class GatysTexture(PlanarTexture):
    """A flat picture, put on meshes by their UVs."""

    method = METHOD.name
