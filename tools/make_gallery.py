"""Renders the gallery: each bundled model on the training sphere and on unseen meshes, the exemplar beside
it.

usage: python tools/make_gallery.py EXEMPLARS MESHES [NAME | SHEET=EXEMPLAR=RUN ...]

EXEMPLARS and MESHES are folders; the sheets go to docs/gallery/NAME.jpg, or SHEET.jpg for a run folder. Below
the path-traced pictures are the maps as they are, to see that they are in register. Without names, the row of
pictures that README begins with, the thumbnails of all models beside their exemplars, and the sheet of the
controls are made too.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from mitex.exemplar import Exemplar
from mitex.exemplar import names as exemplar_names
from mitex.images import read_image, write_image
from mitex.mesh import Mesh, embedded, icosphere
from mitex.methods.nca import Graft, NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.film import FilmSettings, PreviewCamera, States
from mitex.methods.nca.growth import grown_state
from mitex.methods.nca.orientation import Orientation
from mitex.methods.nca.region import region
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.methods.nca.texture import GrowingTexture
from mitex.methods.nca.weights import graft_weights
from mitex.render import sheet, still, tone
from mitex.scenes.cameras import orbit

sys.path.insert(0, str(Path(__file__).parent))
from make_models import MODELS, RECIPES  # noqa: E402

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
UNSEEN = ("spot", "fish", "mug")
TEASER = {"ceramic": "octopus", "lava": "knot", "cobblestone": "vase", "shells": "shaderball"}
FREQUENCY, RESOLUTION, CELL = 32, 2048, 256
SPHERE = icosphere(26)  # of the controls: large patterns are seen better


def unlit(texture: NcaTexture) -> list[np.ndarray]:
    """Views of every map on the training sphere, in the order of the exemplar's names."""
    mesh = icosphere(FREQUENCY)
    sphere = TrainingMesh.of(mesh, texture.look)
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


Labelled = list[tuple[str, np.ndarray]]


def controls() -> np.ndarray:
    """What can be done with trained models: grafts, healing, density, orientation, steps; a row each."""
    return _rows([*_grafts(), *_healing(), *_densities(), *_orientations(), *_growth()])


def living() -> np.ndarray:
    """What grows instead of being painted: a row of grafts, and a film of healing."""
    return _rows([*_grafts(), *_healing()])


def _rows(pictures: Labelled) -> np.ndarray:
    labels, images = zip(*pictures, strict=True)
    return sheet(images, columns=5, labels=labels, cell=CELL)


def _grafts() -> Labelled:
    places = {
        ("ceramic", "bricks"): "x:-0.4:0.4",
        ("lava", "shells"): "x:-0.4:0.4",
        ("cobblestone", "lava"): "0,0.25,1,0.9",
        ("honeycomb", "hexagons"): "y:-0.4:0.4",
        ("wicker", "knit"): "x:-0.4:0.4",
    }
    rows = []
    for (first, second), weights in places.items():
        graft = Graft(NcaTexture.load(first), NcaTexture.load(second), graft_weights(SPHERE, weights))
        rows.append((f"{first} into {second}", _grown(graft, SPHERE, 300, azimuth=0.0)))
    return rows


def _healing() -> Labelled:
    """A ball of cells is set back to the seed in the second picture."""
    mesh, settings = embedded("vase"), FilmSettings(resolution=CELL, damage_at=1 / 24)
    cells = Cells.of(mesh, 0)
    growth, camera = NcaTexture.load("lava").growth(cells), PreviewCamera(mesh, settings)
    inside = torch.from_numpy(region("0.25,0.1,0.55,0.3")(cells.mesh.vertices))
    states = States(growth, replace(settings, steps_per_frame=10, start=200), 0, inside)
    frames = dict(zip(range(17), states.frames(0, 17), strict=True))
    steps = {0: "before", 1: "damaged", 2: "10 steps later", 5: "40 steps later", 16: "150 steps later"}
    return [(label, camera.picture(growth.texture(frames[k]))) for k, label in steps.items()]


def _densities() -> Labelled:
    scales, texture = (0.5, 0.7, 1.0, 1.4, 2.0), NcaTexture.load("hexagons")
    return [(f"--scale {s:g}", _grown(texture, SPHERE, 500, scale=s)) for s in scales]


def _orientations() -> Labelled:
    texture = NcaTexture.load("planks")
    rows = []
    for turn in (0, 45, 90, "1,1,0", "about-x"):
        azimuth = 90.0 if turn == "about-x" else 25.0  # a field around the axis is seen from its end
        rows.append((f"--orientation {turn}", _grown(texture, SPHERE, 200, azimuth, orientation=turn)))
    return rows


def _growth() -> Labelled:
    texture = NcaTexture.load("ceramic")
    return [(f"--steps {n}", _grown(texture, SPHERE, n)) for n in (20, 60, 120, 300, 1000)]


def _grown(
    texture: GrowingTexture,
    mesh: Mesh,
    steps: int,
    azimuth: float = 25.0,
    scale: float = 1.0,
    orientation: Orientation = 0.0,
) -> np.ndarray:
    """A preview (H, W, 3) of a texture on a mesh."""
    cells = Cells.of(mesh, 0, scale)
    growth = texture.growth_on(cells, mesh, orientation)
    camera = PreviewCamera(mesh, FilmSettings(resolution=CELL, azimuth=azimuth))
    return camera.picture(growth.texture(grown_state(growth, 0, steps)))


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
        write_image(GALLERY / "nca-controls.jpg", controls())
        write_image(GALLERY / "living.jpg", living())
    for word in sys.argv[3:] or RECIPES:
        name, source, model = word.split("=") if "=" in word else (word, RECIPES[word].exemplar, word)
        picture = one(NcaTexture.load(model), _exemplar(source, exemplars), meshes)
        write_image(GALLERY / f"{name}.jpg", picture)


if __name__ == "__main__":
    main()
