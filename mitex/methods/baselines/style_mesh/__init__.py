"""StyleMesh: textures through views, whose styles keep their size in space (Hoellein et al. 2022)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="style_mesh",
    title="match the Gram matrices of views, by depth and angle (compared with surface)",
    presets="mitex.methods.baselines.style_mesh.config:PRESETS",
    fit="mitex.methods.baselines.style_mesh.cli:Fit",
    apply="mitex.methods.baselines.style_mesh.cli:Apply",
    texture="mitex.methods.baselines.style_mesh.texture:StyleMeshTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "StyleMeshConfig", "StyleMeshTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.style_mesh.config",
        "StyleMeshConfig": "mitex.methods.baselines.style_mesh.config",
        "StyleMeshTexture": "mitex.methods.baselines.style_mesh.texture",
        "fit": "mitex.methods.baselines.style_mesh.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.style_mesh.config import PRESETS, StyleMeshConfig
    from mitex.methods.baselines.style_mesh.fitting import fit
    from mitex.methods.baselines.style_mesh.texture import StyleMeshTexture
