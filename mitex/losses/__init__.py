"""Losses on images, features and states: pure torch."""

from mitex.losses.advection import advection_residual
from mitex.losses.augmentation import Augmentation
from mitex.losses.autocorrelation import autocorrelation_distance
from mitex.losses.gram import gram_distance, gram_loss, gram_matrix, gram_targets
from mitex.losses.laplacian import laplacian_excess
from mitex.losses.motion import MotionLoss, motion_loss
from mitex.losses.overflow import overflow_loss
from mitex.losses.slopes import slope_correlation
from mitex.losses.text import directional_distance, embedding_distance, mean_direction, text_distance
from mitex.losses.transport import channel_transport, moment_distance, relaxed_transport

__all__ = [
    "Augmentation",
    "MotionLoss",
    "advection_residual",
    "autocorrelation_distance",
    "channel_transport",
    "directional_distance",
    "embedding_distance",
    "gram_distance",
    "gram_loss",
    "gram_matrix",
    "gram_targets",
    "laplacian_excess",
    "mean_direction",
    "moment_distance",
    "motion_loss",
    "overflow_loss",
    "relaxed_transport",
    "slope_correlation",
    "text_distance",
]
