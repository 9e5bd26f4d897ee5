"""Text2Mesh, by words or an image: colours and offsets as functions of the place (Michel et al. 2022)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="text2mesh",
    title="learn a network of the place by views, from an image or words (compared with nca)",
    presets="mitex.methods.baselines.text2mesh.config:PRESETS",
    fit="mitex.methods.baselines.text2mesh.cli:Fit",
    apply="mitex.methods.baselines.text2mesh.cli:Apply",
    texture="mitex.methods.baselines.text2mesh.texture:Text2MeshTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "Text2MeshConfig", "Text2MeshTexture", "fit", "fit_text"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.text2mesh.config",
        "Text2MeshConfig": "mitex.methods.baselines.text2mesh.config",
        "Text2MeshTexture": "mitex.methods.baselines.text2mesh.texture",
        "fit": "mitex.methods.baselines.text2mesh.fitting",
        "fit_text": "mitex.methods.baselines.text2mesh.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.text2mesh.config import PRESETS, Text2MeshConfig
    from mitex.methods.baselines.text2mesh.fitting import fit, fit_text
    from mitex.methods.baselines.text2mesh.texture import Text2MeshTexture
