"""X-Mesh: colours and offsets of a mesh from words, through gates that the words set (Ma et al. 2023)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="x_mesh",
    title="learn a network of the place, gated by words, from words (compared with nca)",
    presets="mitex.methods.baselines.x_mesh.config:PRESETS",
    fit="mitex.methods.baselines.x_mesh.cli:Fit",
    apply="mitex.methods.baselines.x_mesh.cli:Apply",
    texture="mitex.methods.baselines.x_mesh.texture:XMeshTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "XMeshConfig", "XMeshTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.x_mesh.config",
        "XMeshConfig": "mitex.methods.baselines.x_mesh.config",
        "XMeshTexture": "mitex.methods.baselines.x_mesh.texture",
        "fit": "mitex.methods.baselines.x_mesh.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.x_mesh.config import PRESETS, XMeshConfig
    from mitex.methods.baselines.x_mesh.fitting import fit
    from mitex.methods.baselines.x_mesh.texture import XMeshTexture
