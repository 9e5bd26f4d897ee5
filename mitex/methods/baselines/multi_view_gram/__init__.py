"""Style transfer onto textured meshes through random views (Mordvintsev et al. 2018)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="multi_view_gram",
    title="match the Gram matrices of random views of one mesh (compared with surface)",
    presets="mitex.methods.baselines.multi_view_gram.config:PRESETS",
    fit="mitex.methods.baselines.multi_view_gram.cli:Fit",
    apply="mitex.methods.baselines.multi_view_gram.cli:Apply",
    texture="mitex.methods.baselines.multi_view_gram.texture:MultiViewTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "MultiViewConfig", "MultiViewTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.multi_view_gram.config",
        "MultiViewConfig": "mitex.methods.baselines.multi_view_gram.config",
        "MultiViewTexture": "mitex.methods.baselines.multi_view_gram.texture",
        "fit": "mitex.methods.baselines.multi_view_gram.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.multi_view_gram.config import PRESETS, MultiViewConfig
    from mitex.methods.baselines.multi_view_gram.fitting import fit
    from mitex.methods.baselines.multi_view_gram.texture import MultiViewTexture
