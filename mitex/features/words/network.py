"""Two small encoders into one space: pictures by convolutions, texts by attention."""

from __future__ import annotations

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import nn

from mitex.features.words.vocabulary import CONCEPTS, LONGEST

RESOLUTION = 64  # of a picture [px]
SIZE = 128  # of an embedding
WIDTHS = (32, 64, 160)  # channels at 32, 16 and 8 pixels
KERNELS = (6, 4, 4)  # of the convolutions that halve the size
DEPTHS = (0, 2, 3)  # convolutions at these sizes, beside those that halve it
AROUND = 8  # pixels over which contrast is measured, and twice as many in part [px]
NOISE = 0.06  # standard deviation below which contrast counts as noise
HEADS = 4
LAYERS = 2


class ImageEncoder(nn.Module):
    """Residual convolutions at three sizes; every place votes for what is there, and the mean vote counts.

    They see the colours, and what is left of them when brightness and contrast are normalised. Smooth
    activations and means, no maxima, and strides that divide the filters' widths, so that the gradient in the
    picture is smooth and reaches every pixel. Since votes are local, a picture fits a text best when it does
    so everywhere. Batch normalisation is but a scale and a shift once it is trained.
    """

    def __init__(self) -> None:
        super().__init__()
        inputs = (6, *WIDTHS[:-1])
        self.halving = nn.ModuleList(
            _convolution(a, b, kernel, 2) for a, b, kernel in zip(inputs, WIDTHS, KERNELS, strict=True)
        )
        self.trunks = nn.ModuleList(
            nn.ModuleList(_convolution(width, width, 3, 1) for _ in range(depth))
            for width, depth in zip(WIDTHS, DEPTHS, strict=True)
        )
        self.hidden = _convolution(sum(WIDTHS), 2 * SIZE, 1, 1)
        self.out = nn.Conv2d(2 * SIZE, SIZE, 1)

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """(K, 128) of (K, 3, 64, 64) sRGB in [0, 1]."""
        x, levels = torch.cat([4 * images - 2, normalised_contrast(images)], 1), []
        for halve, trunk in zip(self.halving, self.trunks, strict=True):
            x = halve(x)
            for layer in trunk.children():
                x = x + layer(x)
            levels.append(x)
        coarse = [F.avg_pool2d(level, level.shape[2] // x.shape[2]) for level in levels]
        return self.out(self.hidden(torch.cat(coarse, 1))).mean((2, 3))


def _convolution(inputs: int, outputs: int, kernel: int, stride: int) -> nn.Sequential:
    layer = nn.Conv2d(inputs, outputs, kernel, stride, (kernel - 1) // 2, bias=False)
    nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.SiLU())


def normalised_contrast(images: torch.Tensor) -> torch.Tensor:
    """(I - mean) / sqrt(variance + NOISE^2), from about 16 pixels around: patterns look alike in all colours.

    Args:
        images: (K, 3, 64, 64) in [0, 1]; the variance is that of all three channels.

    Returns:
        (K, 3, 64, 64), about -3 to 3.
    """
    centred = images - _around(images)
    return centred / (_around(centred.square().mean(1, keepdim=True)) + NOISE**2).sqrt()


def _around(images: torch.Tensor) -> torch.Tensor:
    coarse = F.avg_pool2d(images, AROUND)
    return F.interpolate(coarse, scale_factor=float(AROUND), mode="bilinear", align_corners=False)


class TextEncoder(nn.Module):
    """Embeddings of concepts and of their places, two layers of attention, and the mean over the text."""

    def __init__(self) -> None:
        super().__init__()
        self.concepts = nn.Embedding(len(CONCEPTS) + 1, SIZE, padding_idx=0)
        self.places = nn.Parameter(torch.randn(LONGEST, SIZE))
        layer = nn.TransformerEncoderLayer(
            SIZE, HEADS, 2 * SIZE, dropout=0.0, activation=F.gelu, batch_first=True, norm_first=True
        )
        self.layers = nn.TransformerEncoder(layer, LAYERS, enable_nested_tensor=False)
        self.out = nn.Linear(SIZE, SIZE)

    def forward(self, numbers: torch.Tensor) -> torch.Tensor:
        """(N, 128) of (N, L) places in `CONCEPTS` from 1 on, filled up with 0."""
        present = numbers > 0
        x = self.concepts(numbers) + self.places[: numbers.shape[1]]
        x = self.layers(x, src_key_padding_mask=~present) * present[..., None]
        return self.out(x.sum(1) / present.sum(1, keepdim=True))


class WordsNetwork(nn.Module):
    """Both encoders, with the temperature of their training."""

    def __init__(self) -> None:
        super().__init__()
        self.image, self.text = ImageEncoder(), TextEncoder()
        self.log_scale = nn.Parameter(torch.tensor(2.7))


_NUMBERS = {concept: number for number, concept in enumerate(CONCEPTS, 1)}


def numbered(texts: Sequence[Sequence[str]]) -> torch.Tensor:
    """(N, L) int64: the concepts of each text by number, filled up with 0 to the longest."""
    longest = max(map(len, texts))
    return torch.tensor([[_NUMBERS[c] for c in text] + [0] * (longest - len(text)) for text in texts])
