"""Frozen networks that look at pictures."""

from mitex.features.layers import LAYERS
from mitex.features.vgg import Vgg16

__all__ = ["LAYERS", "Vgg16"]
