"""Mesh neural cellular automata (Pajouheshgar et al. 2024)."""

from mitex.methods.nca.config import PRESETS, NcaConfig
from mitex.methods.nca.fit import fit
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.texture import NcaTexture

__all__ = ["PRESETS", "MeshNCA", "NcaConfig", "NcaTexture", "fit"]
