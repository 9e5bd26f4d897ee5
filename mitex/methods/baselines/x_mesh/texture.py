"""`XMeshTexture`: the network's colours as a texture, and its offsets as a shape."""

from mitex.methods.baselines.x_mesh import METHOD
from mitex.methods.neural_style.styled_mesh import StyledMesh


class XMeshTexture(StyledMesh):
    """What was learned: a texture and its mesh, each vertex where the training had it.

    The authors' exporter multiplies the offsets by the normals, and writes another shape.
    """

    method = METHOD.name
