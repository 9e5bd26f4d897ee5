"""Frozen networks that look at pictures."""

from mitex.features.vgg import LAYERS, Vgg16

__all__ = ["LAYERS", "Vgg16"]
