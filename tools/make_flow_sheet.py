"""Draws docs/gallery/nca-flow.jpg: textures that flow, some moments one after the other.

usage: python tools/make_flow_sheet.py MODEL [MODEL ...] [--out FILE]

A MODEL moves, as of `mitex fit nca --motion`. It has a row for each of the fields.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch

from mitex.images import write_image
from mitex.mesh import embedded, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.film import PreviewCamera, Shooting
from mitex.render import sheet

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "nca-flow.jpg"
ROWS = {"right": icosphere(26), "about-y": embedded("vase")}
PICTURES, STEPS, CELL = 5, 12, 256  # in a row, between two of them, and their side [px]


def moments(texture: NcaTexture, field: str) -> list[np.ndarray]:
    """Pictures (H, W, 3) of a texture that follows a field."""
    mesh, generator = ROWS[field], torch.Generator().manual_seed(0)
    cells = Cells.of(mesh, 0)
    growth = texture.growth(cells, 0.0, texture.motion(cells, field))
    camera = PreviewCamera(mesh, Shooting(resolution=CELL, azimuth=0.0))
    state, pictures = growth.evolve(growth.seed(), texture.steps, generator), []
    for _ in range(PICTURES):
        pictures.append(camera.picture(growth.shown(state)))
        state = growth.evolve(state, STEPS, generator)
    return pictures


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--out", type=Path, default=SHEET)
    options = parser.parse_args()
    pictures, labels = [], []
    for model in options.models:
        texture = NcaTexture.load(model)
        for field in ROWS:
            pictures += moments(texture, field)
            name = f"{texture.about['name']}, {field}"
            labels += [name, *(f"{k * STEPS} steps later" for k in range(1, PICTURES))]
    print(write_image(options.out, sheet(pictures, columns=PICTURES, labels=labels, cell=CELL)))


if __name__ == "__main__":
    main()
