"""The motion between two frames."""

from mitex.features.flow.lucas_kanade import lucas_kanade, smaller_eigenvalue

__all__ = ["lucas_kanade", "smaller_eigenvalue"]
