"""Draws docs/gallery/baselines.jpg: one exemplar on one mesh, by methods and what they are compared with.

    python tools/make_baselines_sheet.py lava vase runs/surface lava runs/quilted ...

The arguments are an exemplar, a mesh, and models. The pattern is as large in all pictures: the exemplar is
half as wide as the side of the layout that surface textures have.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from mitex.exemplar import Exemplar
from mitex.images import read_image, write_image
from mitex.mesh import Mesh
from mitex.methods.interface import Applied
from mitex.methods.layout import EXEMPLAR_WIDTH
from mitex.methods.nca import NcaTexture
from mitex.methods.registry import load, method_of
from mitex.render import sheet

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "baselines.jpg"
CELL, SPP = 384, 96  # side of a picture [px], and rays of each pixel


def applied(model: str, mesh: Mesh) -> Applied:
    """A model's texture on the mesh."""
    texture = load(model)
    if isinstance(texture, NcaTexture):
        return texture.apply(mesh, exemplar_width=EXEMPLAR_WIDTH)
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
