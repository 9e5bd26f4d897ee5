"""`Text2MeshTexture`: the network's colours as a texture."""

from mitex.methods.baselines.text2mesh import METHOD
from mitex.methods.mesh_texture import MeshTexture


class Text2MeshTexture(MeshTexture):
    """What was learned, as a texture, and its mesh."""

    method = METHOD.name
