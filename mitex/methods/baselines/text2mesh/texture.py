"""`Text2MeshTexture`: the network's colours as a texture, and its offsets as a shape."""

from mitex.methods.baselines.text2mesh import METHOD
from mitex.methods.neural_style.styled_mesh import StyledMesh


class Text2MeshTexture(StyledMesh):
    """What was learned: a texture and its mesh, which words move and an image leaves as it is."""

    method = METHOD.name
