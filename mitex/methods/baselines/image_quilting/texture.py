"""`QuiltedPicture`: the picture that blocks were quilted to."""

from mitex.methods.baselines.image_quilting import METHOD
from mitex.methods.planar import PlanarTexture


class QuiltedPicture(PlanarTexture):
    """A flat picture, put on meshes by their UVs."""

    method = METHOD.name
