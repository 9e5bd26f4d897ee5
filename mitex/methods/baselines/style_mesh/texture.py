"""`StyleMeshTexture`: the texture that was optimized."""

from mitex.methods.baselines.style_mesh import METHOD
from mitex.methods.mesh_texture import MeshTexture


class StyleMeshTexture(MeshTexture):
    """A texture that was optimized through views, and its mesh."""

    method = METHOD.name
