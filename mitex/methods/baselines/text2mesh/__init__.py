"""Text2Mesh with an image as its target: colours as a function of the place (Michel et al. 2022)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="text2mesh",
    title="learn a network of the place whose views look like an exemplar (compared with nca)",
    presets="mitex.methods.baselines.text2mesh.config:PRESETS",
    fit="mitex.methods.baselines.text2mesh.cli:Fit",
    apply="mitex.methods.baselines.text2mesh.cli:Apply",
    texture="mitex.methods.baselines.text2mesh.texture:Text2MeshTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "Text2MeshConfig", "Text2MeshTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.text2mesh.config",
        "Text2MeshConfig": "mitex.methods.baselines.text2mesh.config",
        "Text2MeshTexture": "mitex.methods.baselines.text2mesh.texture",
        "fit": "mitex.methods.baselines.text2mesh.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.text2mesh.config import PRESETS, Text2MeshConfig
    from mitex.methods.baselines.text2mesh.fitting import fit
    from mitex.methods.baselines.text2mesh.texture import Text2MeshTexture
