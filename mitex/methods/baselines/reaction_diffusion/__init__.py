"""Differentiable reaction-diffusion patterns (Mordvintsev et al. 2021)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="reaction_diffusion",
    title="learn the reaction of chemicals that diffuse on surfaces (compared with nca)",
    presets="mitex.methods.baselines.reaction_diffusion.config:PRESETS",
    fit="mitex.methods.baselines.reaction_diffusion.cli:Fit",
    apply="mitex.methods.baselines.reaction_diffusion.cli:Apply",
    texture="mitex.methods.baselines.reaction_diffusion.texture:ReactionDiffusionTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "ReactionDiffusionConfig", "ReactionDiffusionTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.reaction_diffusion.config",
        "ReactionDiffusionConfig": "mitex.methods.baselines.reaction_diffusion.config",
        "ReactionDiffusionTexture": "mitex.methods.baselines.reaction_diffusion.texture",
        "fit": "mitex.methods.baselines.reaction_diffusion.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.reaction_diffusion.config import PRESETS, ReactionDiffusionConfig
    from mitex.methods.baselines.reaction_diffusion.fitting import fit
    from mitex.methods.baselines.reaction_diffusion.texture import ReactionDiffusionTexture
