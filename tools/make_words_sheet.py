"""Pictures that the embedded vision-language model leads to: what its gradient knows of the words.

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
    "red and white checks",
    "red brick wall",
    "lava",
    "black rings on orange",
    "colourful mosaic on black",
    "blue scales",
    "yellow stars on dark blue",
)
TILE = 48  # of a picture, which repeats it two by two [px]
LEVELS = 4
STEPS = 120
PIECES = 6  # that are compared with the text in each step
NOISE = 0.04  # that is added to the pieces
COLUMNS = 6


def optimized(model: WordsModel, text: str, seed: int = 0) -> np.ndarray:
    """A picture for a text, (96, 96, 3) sRGB in [0, 1], from noise, by the cosine of random pieces and text.

    Its tile is a sum of grids of several sizes, so that the gradient may change what is large as well.
    """
    generator = torch.Generator().manual_seed(seed)
    sizes = [TILE // 2**k for k in range(LEVELS)]
    levels = [0.3 * torch.randn(1, 3, size, size, generator=generator) for size in sizes]
    optimizer = torch.optim.Adam([level.requires_grad_() for level in levels], 0.05)
    meant = model.encode_texts([text])
    for _ in range(STEPS):
        pieces = _pieces(_picture(levels), model.resolution, generator)
        pieces = (pieces + NOISE * torch.randn(pieces.shape, generator=generator)).clamp(0, 1)
        seen = model.encode_images(pieces.permute(0, 2, 3, 1))
        optimizer.zero_grad()
        (1 - F.cosine_similarity(seen, meant)).mean().backward()
        optimizer.step()
    return _picture(levels)[0].permute(1, 2, 0).detach().numpy()


def _picture(levels: list[torch.Tensor]) -> torch.Tensor:
    """(1, 3, 96, 96) in [0, 1]: the sum of the levels, which go on over their borders, two by two times."""
    total = torch.zeros(1, 3, TILE, TILE)
    for level in levels:
        times = TILE // level.shape[2]
        wide = F.pad(level, (1, 1, 1, 1), "circular")
        wide = F.interpolate(wide, scale_factor=float(times), mode="bilinear", align_corners=False)
        total = total + wide[:, :, times : times + TILE, times : times + TILE]
    return torch.sigmoid(total).repeat(1, 1, 2, 2)


def _pieces(picture: torch.Tensor, side: int, generator: torch.Generator) -> torch.Tensor:
    """(PIECES, 3, side, side): squares of about half to nine tenths of the width, at random places."""
    shifts = torch.randint(TILE, (2,), generator=generator).tolist()
    scale = 0.55 + 0.3 * torch.rand(PIECES, generator=generator)
    shift = (1 - scale) * (2 * torch.rand(2, PIECES, generator=generator) - 1)
    none = torch.zeros(PIECES)
    frames = torch.stack([scale, none, shift[0], none, scale, shift[1]], 1).view(PIECES, 2, 3)
    grid = F.affine_grid(frames, [PIECES, 3, side, side], align_corners=False)
    rolled = picture.roll(shifts, (2, 3)).expand(PIECES, -1, -1, -1)
    return F.grid_sample(rolled, grid, align_corners=False)


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
        pictures.append(optimized(words_model(), text))
    write_image(options.out, sheet(pictures))


if __name__ == "__main__":
    main()
