"""`MultiViewTexture`: the texture that was optimized."""

from mitex.methods.baselines.multi_view_gram import METHOD
from mitex.methods.mesh_texture import MeshTexture


class MultiViewTexture(MeshTexture):
    """A texture that was optimized through views, and its mesh."""

    method = METHOD.name
