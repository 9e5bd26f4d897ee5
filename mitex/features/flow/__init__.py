"""The motion between two frames: a small trained network, and Lucas and Kanade's method without weights."""

from mitex.features.flow.lucas_kanade import lucas_kanade, smaller_eigenvalue
from mitex.features.flow.network import FlowNetwork, flow_network

__all__ = ["FlowNetwork", "flow_network", "lucas_kanade", "smaller_eigenvalue"]
