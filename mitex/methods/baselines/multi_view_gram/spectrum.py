"""A picture as its spectrum: decorrelated in space and in colour (Mordvintsev et al. 2018)."""

from __future__ import annotations

import torch

CONTRAST = 0.25  # of the picture before the sigmoid, as the authors scale it
SPREAD = 0.01  # of the coefficients at the start

# Square root of the covariance of ImageNet's colours, by columns; divided by the longest column.
COLOURS = torch.tensor([[0.26, 0.09, 0.02], [0.27, 0.0, -0.05], [0.27, -0.09, 0.03]])
COLOURS = COLOURS / COLOURS.norm(dim=0).max()


def random_spectrum(side: int, generator: torch.Generator) -> torch.Tensor:
    """(2, 3, N, N // 2 + 1) Gaussian real and imaginary parts of a picture of N x N pixels at the start."""
    return SPREAD * torch.randn(2, 3, side, side // 2 + 1, generator=generator)


def image_of(spectrum: torch.Tensor) -> torch.Tensor:
    """The picture (N, N, 3), in (0, 1), of a spectrum (2, 3, N, N // 2 + 1).

    Coefficients are scaled by 1 / frequency, so that a step of the optimizer changes large and small
    structures as much as natural pictures have of them.
    """
    side = spectrum.shape[2]
    coefficients = torch.complex(spectrum[0], spectrum[1]) * _amplitudes(side).to(spectrum)
    components = CONTRAST * torch.fft.irfft2(coefficients, s=(side, side))
    return torch.sigmoid(components.permute(1, 2, 0) @ COLOURS.to(spectrum).T)


def _amplitudes(side: int) -> torch.Tensor:
    """(N, N // 2 + 1) N / f, for frequencies f [cycles a pixel] of at least one cycle in the picture."""
    frequency = torch.hypot(torch.fft.fftfreq(side)[:, None], torch.fft.rfftfreq(side)[None])
    return side / frequency.clamp(min=1 / side)
