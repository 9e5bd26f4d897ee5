"""Draws docs/gallery/baselines.jpg: one exemplar on one mesh, by methods and what they are compared with.

    python tools/make_baselines_sheet.py lava vase runs/surface lava runs/quilted ...

The arguments are an exemplar, a mesh, and models. The pattern is as large in all pictures: the exemplar is
half as wide as the side of the layout that surface textures have.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mitex.exemplar import Exemplar
from mitex.geometry.triangles import twice_area
from mitex.images import read_image, write_image
from mitex.mesh import Mesh
from mitex.methods.interface import Applied
from mitex.methods.layout import with_layout
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.texture import DENSITY
from mitex.methods.registry import load, method_of
from mitex.render import sheet

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "baselines.jpg"
WIDTH, LAYOUT = 0.5, 512  # of the exemplar [sides of the layout's square], and the layout's resolution
CELL, SPP = 384, 96  # side of a picture [px], and rays of each pixel


def nca_scale(mesh: Mesh, texture: NcaTexture) -> float:
    """The `scale` at which an automaton's exemplar is as wide as that of a surface texture."""
    laid = with_layout(mesh, LAYOUT)
    assert laid.uv is not None
    side = np.median(np.sqrt(mesh.face_areas / np.maximum(0.5 * np.abs(twice_area(laid.uv)), 1e-12)))
    density = float(texture.about.get("density", DENSITY))
    return float(WIDTH * side / (density * Cells.of(mesh).mesh.edge_lengths.mean()))


def applied(model: str, mesh: Mesh) -> Applied:
    """A model's texture on the mesh."""
    texture = load(model)
    if isinstance(texture, NcaTexture):
        return texture.apply(mesh, scale=nca_scale(mesh, texture))
    return texture.apply(mesh)


def main() -> None:
    exemplar, mesh, *models = sys.argv[1:]
    surface = Mesh.load(mesh)
    pictures, labels = [Exemplar.load(exemplar).resized(CELL).maps["albedo"]], ["exemplar"]
    with TemporaryDirectory() as folder:
        for model in models:
            path = Path(folder) / "a.png"
            applied(model, surface).render(path, resolution=CELL, spp=SPP)
            pictures.append(read_image(path))
            labels.append(method_of(model).name)
    write_image(SHEET, sheet(pictures, columns=4, labels=labels, cell=CELL))
    print(SHEET)


if __name__ == "__main__":
    main()
