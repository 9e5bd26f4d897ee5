"""Renders the gallery: each bundled model on the training sphere and on unseen meshes, the exemplar beside
it.

usage: python tools/make_gallery.py EXEMPLARS MESHES [NAME | SHEET=EXEMPLAR=RUN ...]

EXEMPLARS and MESHES are folders; the sheets go to docs/gallery/NAME.jpg, or SHEET.jpg for a run folder. Below
the path-traced pictures are the maps as they are, to see that they are in register. Without names, the row of
pictures that README begins with, and the thumbnails of all models beside their exemplars, are made too.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import torch

from mitex.exemplar import Exemplar
from mitex.exemplar import names as exemplar_names
from mitex.images import read_image, write_image
from mitex.mesh import Mesh, embedded, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.surfaces import TrainingSphere
from mitex.render import sheet, still, tone
from mitex.scenes.cameras import orbit

sys.path.insert(0, str(Path(__file__).parent))
from make_models import MODELS, RECIPES  # noqa: E402

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
UNSEEN = ("spot", "fish", "mug")
TEASER = {"ceramic": "octopus", "lava": "knot", "cobblestone": "vase", "shells": "shaderball"}
FREQUENCY, RESOLUTION, CELL = 32, 2048, 256


def unlit(texture: NcaTexture) -> list[np.ndarray]:
    """Views of every map on the training sphere, in the order of the exemplar's names."""
    mesh = icosphere(FREQUENCY)
    sphere = TrainingSphere.of(mesh, texture.look)
    with torch.no_grad():
        cameras = orbit(1, distance=2.05, resolution=CELL)
        view = sphere.views(texture.look, texture.grow(mesh), cameras, antialias=4)[0].clamp(0, 1).numpy()
    return [np.broadcast_to(view[..., list(c)], (CELL, CELL, 3)) for c in texture.look.layout.values()]


def one(texture: NcaTexture, exemplar: Exemplar, meshes: Path) -> np.ndarray:
    """The sheet of a model, (H, W, 3) sRGB in [0, 1]."""
    unseen = [Mesh.load(meshes / f"{mesh}.obj") for mesh in UNSEEN]
    assets = [texture.apply(mesh, resolution=RESOLUTION) for mesh in (icosphere(FREQUENCY), *unseen)]
    lit = [tone(still(asset, resolution=CELL, spp=96)) for asset in assets]
    square = exemplar.resized(CELL).maps
    names = texture.look.maps
    rows = [square["albedo"], *lit, *(np.broadcast_to(square[name], (CELL, CELL, 3)) for name in names)]
    labels = [f"exemplar {exemplar.name}", "sphere", *UNSEEN]
    labels += [f"exemplar: {name}" for name in names] + [f"grown: {name}" for name in names]
    return sheet([*rows, *unlit(texture)], columns=5, labels=labels, cell=CELL)


def teaser() -> np.ndarray:
    """One model on one embedded mesh each, in a row."""
    assets = [NcaTexture.load(model).apply(embedded(mesh)) for model, mesh in TEASER.items()]
    pictures = [tone(still(asset, resolution=CELL, spp=144)) for asset in assets]
    return np.concatenate(pictures, axis=1)


def thumbnails(exemplars: Path) -> np.ndarray:
    """Every bundled model's exemplar, and its thumbnail."""
    cells, labels = [], []
    for name, recipe in sorted(RECIPES.items()):
        cells += [_exemplar(recipe.exemplar, exemplars).resized(CELL).maps["albedo"]]
        cells += [read_image(MODELS / f"{name}.png")[..., :3]]
        labels += [f"exemplar {recipe.exemplar}", name]
    return sheet(cells, columns=6, labels=labels, cell=CELL)


def _exemplar(name: str, folder: Path) -> Exemplar:
    return Exemplar.load(name if name in exemplar_names() else folder / name)


def main() -> None:
    exemplars, meshes = Path(sys.argv[1]), Path(sys.argv[2])
    GALLERY.mkdir(parents=True, exist_ok=True)
    if len(sys.argv) == 3:
        write_image(GALLERY / "teaser.jpg", teaser())
        write_image(GALLERY / "models.jpg", thumbnails(exemplars))
    for word in sys.argv[3:] or RECIPES:
        name, source, model = word.split("=") if "=" in word else (word, RECIPES[word].exemplar, word)
        picture = one(NcaTexture.load(model), _exemplar(source, exemplars), meshes)
        write_image(GALLERY / f"{name}.jpg", picture)


if __name__ == "__main__":
    main()
