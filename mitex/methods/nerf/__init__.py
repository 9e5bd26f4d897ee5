"""NeRF-Texture: textures with a meso-structure, captured from photos (Huang et al. 2023)."""

from mitex.methods.nerf.capture.capture import Capture, load_capture
from mitex.methods.nerf.config import PRESETS, NerfConfig
from mitex.methods.nerf.fit import fit
from mitex.methods.nerf.texture import NerfTexture

__all__ = ["PRESETS", "Capture", "NerfConfig", "NerfTexture", "fit", "load_capture"]
