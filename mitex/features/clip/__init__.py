"""CLIP (Radford et al. 2021): any folder in Hugging Face's format, frozen; none ships with Mitex."""

from mitex.features.clip.folder import cached_folder, named_folder
from mitex.features.clip.model import Clip

__all__ = ["Clip", "cached_folder", "named_folder"]
