"""Draws docs/gallery/nca-flow.jpg, textures that flow, some moments one after the other, and a film of them.

usage: python tools/make_flow_sheet.py MODEL ... [--scenes FIELD=MESH ...] [--out FILE] [--film FILE]

A MODEL is a bundled one, a file or a run folder; a MESH is `sphere`, one that ships or a file. The sheet has
a row for each model and scene. The film is a square of as many models, side by side, as there are scenes.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from itertools import islice, product
from pathlib import Path

import numpy as np
import torch

from mitex.images import write_image
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.film import FilmSettings, PreviewCamera
from mitex.methods.nca.motion.cell_motion import STILL, follows_fields
from mitex.render import sheet
from mitex.render.video import check_video, write_video

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "nca-flow.jpg"
SCENES = ("right=sphere", "about-y=vase")
FREQUENCY = 26  # of the sphere
PICTURES, STEPS, CELL = 5, 12, 160  # in a row, between two of them, and their side [px]
FRAMES, FPS, FILM_CELL = 72, 24, 192  # of the film, which has a step between two frames


def meshes(scenes: list[str]) -> dict[str, Mesh]:
    """The mesh of each field."""
    pairs = (scene.rsplit("=", 1) for scene in scenes)
    return {field: icosphere(FREQUENCY) if mesh == "sphere" else Mesh.load(mesh) for field, mesh in pairs}


def moments(texture: NcaTexture, field: str, mesh: Mesh, steps: int, side: int) -> Iterator[np.ndarray]:
    """Pictures (side, side, 3) of a texture that follows a field, without an end, so many steps apart."""
    generator = torch.Generator().manual_seed(0)
    cells = Cells.of(mesh, 0)
    guided = follows_fields(texture.look, texture.about)  # else as it was trained
    growth = texture.growth(cells, 0.0, texture.motion(cells, field) if guided else STILL)
    camera = PreviewCamera(mesh, FilmSettings(resolution=side, azimuth=0.0))
    state = growth.evolve(growth.seed(), texture.steps, generator)
    while True:
        yield camera.picture(growth.texture(state))
        state = growth.evolve(state, steps, generator)


def write_sheet(textures: list[NcaTexture], scenes: Mapping[str, Mesh], path: Path) -> Path:
    pictures, labels = [], []
    for texture, (field, mesh) in product(textures, scenes.items()):
        pictures += islice(moments(texture, field, mesh, STEPS, CELL), PICTURES)
        name = f"{texture.about['name']}, {field}"
        labels += [name, *(f"{k * STEPS} steps later" for k in range(1, PICTURES))]
    return write_image(path, sheet(pictures, columns=PICTURES, labels=labels, cell=CELL))


def write_film(textures: list[NcaTexture], scenes: Mapping[str, Mesh], path: Path) -> Path:
    count = min(len(textures), len(scenes))
    target = check_video(path, FRAMES, FPS, count * FILM_CELL)
    rows = [
        [moments(texture, field, mesh, 1, FILM_CELL) for texture in textures[:count]]
        for field, mesh in islice(scenes.items(), count)
    ]
    frames = (np.vstack([np.hstack([next(part) for part in row]) for row in rows]) for _ in range(FRAMES))
    return write_video(target, frames, FRAMES, FPS, count * FILM_CELL)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="FIELD=MESH")
    parser.add_argument("--out", type=Path, default=SHEET)
    parser.add_argument("--film", type=Path)
    options = parser.parse_args()
    textures = [NcaTexture.load(model) for model in options.models]
    scenes = meshes(options.scenes)
    print(write_sheet(textures, scenes, options.out))
    if options.film:
        print(write_film(textures, scenes, options.film))


if __name__ == "__main__":
    main()
