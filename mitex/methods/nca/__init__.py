"""Mesh neural cellular automata (Pajouheshgar et al. 2024)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="nca",
    title="learn a living texture from an image, PBR maps or words (MeshNCA)",
    presets="mitex.methods.nca.config:PRESETS",
    fit="mitex.methods.nca.cli:Fit",
    apply="mitex.methods.nca.cli:Apply",
    texture="mitex.methods.nca.texture:NcaTexture",
    animate="mitex.methods.nca.animation:Animate",
    page="mitex.methods.nca.page:contents",
    commands={"graft": ("mitex.methods.nca.grafting:Grafted", "let two textures grow into each other")},
    tensors=frozenset({"fc1.weight", "fc1.bias", "fc2.weight", "fc2.bias"}),
)

__all__ = [
    "METHOD",
    "PRESETS",
    "Graft",
    "GrowingTexture",
    "MeshNCA",
    "NcaConfig",
    "NcaTexture",
    "FilmSettings",
    "fit",
    "fit_text",
    "graft_weights",
    "living_page",
]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.nca.config",
        "Graft": "mitex.methods.nca.graft",
        "NcaConfig": "mitex.methods.nca.config",
        "MeshNCA": "mitex.methods.nca.model",
        "GrowingTexture": "mitex.methods.nca.texture",
        "NcaTexture": "mitex.methods.nca.texture",
        "FilmSettings": "mitex.methods.nca.film",
        "graft_weights": "mitex.methods.nca.weights",
        "living_page": "mitex.methods.nca.page",
        "fit": "mitex.methods.nca.fitting",
        "fit_text": "mitex.methods.nca.text.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.nca.config import PRESETS, NcaConfig
    from mitex.methods.nca.film import FilmSettings
    from mitex.methods.nca.fitting import fit
    from mitex.methods.nca.graft import Graft
    from mitex.methods.nca.model import MeshNCA
    from mitex.methods.nca.page import living_page
    from mitex.methods.nca.text.fitting import fit_text
    from mitex.methods.nca.texture import GrowingTexture, NcaTexture
    from mitex.methods.nca.weights import graft_weights
