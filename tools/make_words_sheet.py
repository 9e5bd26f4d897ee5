"""Pictures that the embedded text-image model leads to: what its gradient knows of the words.

python tools/make_words_sheet.py OUT.jpg ["red dots on white" ...]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from mitex.features.words import WordsModel, words_model
from mitex.images import write_image

TEXTS = (
    "red dots on white",
    "white dots on red",
    "small blue dots on yellow",
    "black and white zigzag",
    "large green stripes on beige",
    "red brick wall",
    "stained glass",
    "lava",
    "black rings on orange",
    "grey pebbles",
    "blue scales",
    "yellow stars on dark blue",
)
SIDE = 96  # of a picture [px]
STEPS = 250
PIECES = 8  # that are compared with the text in each step
COLUMNS = 6
START = "grey"


def optimised(model: WordsModel, text: str, seed: int = 0, steps: int = STEPS) -> np.ndarray:
    """A picture for a text, (96, 96, 3) sRGB in [0, 1], from grey, by the directions of both from grey.

    It is a sum of grids of all sizes, and random pieces of it are compared, so that no single pixel matters.
    """
    generator = torch.Generator().manual_seed(seed)
    sizes = [SIDE // 2**k for k in range(6)]
    levels = [0.02 * torch.randn(1, 3, size, size, generator=generator) for size in sizes]
    optimizer = torch.optim.Adam([level.requires_grad_() for level in levels], 0.03)
    meant = F.normalize(model.encode_texts([text]) - model.encode_texts([START]), dim=1)
    plain = model.encode_images(torch.full((1, model.resolution, model.resolution, 3), 0.5))
    for _ in range(steps):
        pieces = _pieces(_picture(levels), model.resolution, generator)
        seen = F.normalize(model.encode_images(pieces.permute(0, 2, 3, 1)) - plain + 1e-6, dim=1)
        optimizer.zero_grad()
        (1 - (seen * meant).sum(1)).mean().backward()
        optimizer.step()
    return _picture(levels)[0].permute(1, 2, 0).detach().numpy()


def _picture(levels: list[torch.Tensor]) -> torch.Tensor:
    """(1, 3, 96, 96) in [0, 1]."""
    fine = [F.interpolate(level, size=SIDE, mode="bilinear", align_corners=False) for level in levels]
    return torch.sigmoid(2 * torch.stack(fine).sum(0))


def _pieces(picture: torch.Tensor, side: int, generator: torch.Generator) -> torch.Tensor:
    """(PIECES, 3, side, side): squares of half to the whole width of the picture, which repeats itself."""
    shifts = torch.randint(SIDE, (2,), generator=generator).tolist()
    picture = picture.roll(shifts, (2, 3))
    scale = 0.5 + 0.5 * torch.rand(PIECES, generator=generator)
    shift = (1 - scale) * (2 * torch.rand(2, PIECES, generator=generator) - 1)
    none = torch.zeros(PIECES)
    frames = torch.stack([scale, none, shift[0], none, scale, shift[1]], 1).view(PIECES, 2, 3)
    grid = F.affine_grid(frames, [PIECES, 3, side, side], align_corners=False)
    return F.grid_sample(picture.expand(PIECES, -1, -1, -1), grid, align_corners=False)


def sheet(pictures: list[np.ndarray]) -> np.ndarray:
    """The pictures in rows, twice as large."""
    large = [
        np.pad(p.repeat(2, 0).repeat(2, 1), ((4, 4), (4, 4), (0, 0)), constant_values=1) for p in pictures
    ]
    large += [np.ones_like(large[0])] * (-len(large) % COLUMNS)
    rows = [np.concatenate(large[i : i + COLUMNS], 1) for i in range(0, len(large), COLUMNS)]
    return np.concatenate(rows)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("texts", nargs="*", default=TEXTS)
    options = parser.parse_args()
    pictures = []
    for text in options.texts:
        print(text, flush=True)
        pictures.append(optimised(words_model(), text))
    write_image(options.out, sheet(pictures))


if __name__ == "__main__":
    main()
