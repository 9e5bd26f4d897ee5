"""A plain hash-grid radiance field, what view synthesis is compared with (Huang et al. 2023, section 4.2)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="plain_field",
    title="train a plain hash-grid radiance field on photos (compared with NeRF-Texture)",
    presets="mitex.methods.baselines.plain_field.config:PRESETS",
    fit="mitex.methods.baselines.plain_field.cli:Fit",
    apply="mitex.methods.baselines.plain_field.cli:Apply",
    texture="mitex.methods.baselines.plain_field.texture:PlainFieldTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "PlainFieldConfig", "PlainFieldTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.plain_field.config",
        "PlainFieldConfig": "mitex.methods.baselines.plain_field.config",
        "PlainFieldTexture": "mitex.methods.baselines.plain_field.texture",
        "fit": "mitex.methods.baselines.plain_field.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.plain_field.config import PRESETS, PlainFieldConfig
    from mitex.methods.baselines.plain_field.fitting import fit
    from mitex.methods.baselines.plain_field.texture import PlainFieldTexture
