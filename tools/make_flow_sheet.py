"""Draws docs/gallery/nca-flow.jpg, textures that flow, some moments one after the other, and a film of them.

usage: python tools/make_flow_sheet.py MODEL [MODEL ...] [--out FILE] [--film FILE]

A MODEL is a bundled one, a file or a run folder. The sheet has a row for each model and field. The film has
four parts, the first two models along each field.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import islice, product
from pathlib import Path

import numpy as np
import torch

from mitex.images import write_image
from mitex.mesh import embedded, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.film import PreviewCamera, Shooting
from mitex.render import sheet
from mitex.render.video import check_video, write_video

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "nca-flow.jpg"
MESHES = {"right": icosphere(26), "about-y": embedded("vase")}  # by field
PICTURES, STEPS, CELL = 5, 12, 256  # in a row, between two of them, and their side [px]
FRAMES, FPS, FILM_CELL = 72, 24, 192  # of the film, which has a step between two frames


def moments(texture: NcaTexture, field: str, steps: int, side: int) -> Iterator[np.ndarray]:
    """Pictures (side, side, 3) of a texture that follows a field, without an end, so many steps apart."""
    mesh, generator = MESHES[field], torch.Generator().manual_seed(0)
    cells = Cells.of(mesh, 0)
    growth = texture.growth(cells, 0.0, texture.motion(cells, field))
    camera = PreviewCamera(mesh, Shooting(resolution=side, azimuth=0.0))
    state = growth.evolve(growth.seed(), texture.steps, generator)
    while True:
        yield camera.picture(growth.shown(state))
        state = growth.evolve(state, steps, generator)


def write_sheet(textures: list[NcaTexture], path: Path) -> Path:
    pictures, labels = [], []
    for texture, field in product(textures, MESHES):
        pictures += islice(moments(texture, field, STEPS, CELL), PICTURES)
        name = f"{texture.about['name']}, {field}"
        labels += [name, *(f"{k * STEPS} steps later" for k in range(1, PICTURES))]
    return write_image(path, sheet(pictures, columns=PICTURES, labels=labels, cell=CELL))


def write_film(textures: list[NcaTexture], path: Path) -> Path:
    target = check_video(path, FRAMES, FPS, 2 * FILM_CELL)
    parts = [moments(texture, field, 1, FILM_CELL) for texture, field in product(textures[:2], MESHES)]
    frames = (np.vstack([np.hstack([a, b]), np.hstack([c, d])]) for a, b, c, d in zip(*parts, strict=True))
    return write_video(target, islice(frames, FRAMES), FRAMES, FPS, 2 * FILM_CELL)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--out", type=Path, default=SHEET)
    parser.add_argument("--film", type=Path)
    options = parser.parse_args()
    textures = [NcaTexture.load(model) for model in options.models]
    print(write_sheet(textures, options.out))
    if options.film:
        print(write_film(textures, options.film))


if __name__ == "__main__":
    main()
