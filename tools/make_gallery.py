"""Renders the gallery: each bundled model on the training sphere and on unseen meshes, the exemplar beside
it.

usage: python tools/make_gallery.py EXEMPLARS MESHES [NAME | SHEET=EXEMPLAR=RUN ...]

EXEMPLARS and MESHES are folders; the sheets go to docs/gallery/NAME.jpg, or SHEET.jpg for a run folder. Below
the path-traced pictures are the maps as they are, to see that they are in register.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import torch

from mitex import bridge
from mitex.asset import Asset
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import Mesh, embedded, icosphere
from mitex.methods.nca import NcaTexture
from mitex.render import sheet, still, tone
from mitex.scenes.cameras import orbit
from mitex.scenes.stage import Stage

sys.path.insert(0, str(Path(__file__).parent))
from make_models import EXEMPLARS  # noqa: E402

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
UNSEEN = ("spot", "fish", "mug")
TEASER = {"waffle": "octopus", "honeycomb": "knot", "pebbles": "vase", "bricks": "shaderball"}
CELL = 200


def maps_of(asset: Asset) -> list[np.ndarray]:
    """Unlit views of every map, in the order of the exemplar's names."""
    stage = Stage(asset.mesh)
    visibility = stage.visibility(orbit(1, distance=2.05, resolution=CELL), antialias=2)
    views = []
    for values in asset.vertex_maps.values():
        field = torch.from_numpy(np.ascontiguousarray(np.broadcast_to(values, (len(values), 3))))
        views.append(bridge.lookup(field, visibility, background=1.0)[0].numpy())
    return views


def one(texture: NcaTexture, exemplar: Exemplar, meshes: Path) -> np.ndarray:
    """The sheet of a model, (H, W, 3) sRGB in [0, 1]."""
    sphere = texture.apply(icosphere(64))
    assets = [sphere, *(texture.apply(Mesh.load(meshes / f"{mesh}.obj")) for mesh in UNSEEN)]
    lit = [tone(still(asset, resolution=CELL, spp=96)) for asset in assets]
    square = exemplar.resized(CELL).maps
    exemplar_maps = [np.broadcast_to(square[m], (CELL, CELL, 3)) for m in sphere.vertex_maps]
    rows = [square["albedo"], *lit, *exemplar_maps, *maps_of(sphere)]
    labels = [f"exemplar {exemplar.name}", "sphere", *UNSEEN]
    labels += [f"exemplar: {m}" for m in sphere.vertex_maps] + [f"grown: {m}" for m in sphere.vertex_maps]
    return sheet(rows, columns=5, labels=labels, cell=CELL)


def teaser() -> np.ndarray:
    """One model on one embedded mesh each, in a row."""
    assets = [NcaTexture.load(model).apply(embedded(mesh)) for model, mesh in TEASER.items()]
    pictures = [tone(still(asset, resolution=CELL, spp=144)) for asset in assets]
    return np.concatenate(pictures, axis=1)


def main() -> None:
    exemplars, meshes = Path(sys.argv[1]), Path(sys.argv[2])
    GALLERY.mkdir(parents=True, exist_ok=True)
    if len(sys.argv) == 3:
        write_image(GALLERY / "teaser.jpg", teaser())
    for word in sys.argv[3:] or EXEMPLARS:
        name, folder, source = word.split("=") if "=" in word else (word, EXEMPLARS[word], word)
        exemplar = Exemplar.load(exemplars / folder)
        write_image(GALLERY / f"{name}.jpg", one(NcaTexture.load(source), exemplar, meshes))


if __name__ == "__main__":
    main()
