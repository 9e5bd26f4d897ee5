"""The motion between two frames: a small trained network, and Lucas and Kanade's method without weights."""

from mitex.features.flow.estimator import FARTHEST, Estimator, EstimatorName, load_estimator
from mitex.features.flow.lucas_kanade import lucas_kanade, smaller_eigenvalue
from mitex.features.flow.network import FlowNetwork, flow_network

__all__ = [
    "FARTHEST",
    "Estimator",
    "EstimatorName",
    "FlowNetwork",
    "flow_network",
    "load_estimator",
    "lucas_kanade",
    "smaller_eigenvalue",
]
