"""Draws docs/gallery/words-methods.jpg: textures from words on one mesh, by methods.

    python tools/make_words_methods.py vase runs/dots-nca runs/dots-text2mesh runs/dots-x-mesh ...

The arguments are a mesh, and runs of fits from words, three of which are in a row. Reliefs are shown.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from mitex.images import read_image, write_image
from mitex.mesh import Mesh
from mitex.methods.nca import NcaTexture
from mitex.methods.registry import load, method_of
from mitex.render import sheet

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "words-methods.jpg"
COLUMNS, CELL, SPP = 3, 320, 32  # pictures in a row, side of a picture [px], and rays of each pixel


def main() -> None:
    mesh, *runs = sys.argv[1:]
    surface, pictures, labels = Mesh.load(mesh), [], []
    with TemporaryDirectory() as folder:
        for run in runs:
            texture, path = load(run), Path(folder) / "a.png"
            options = {"displace": True} if isinstance(texture, NcaTexture) else {}
            texture.apply(surface, **options).render(path, resolution=CELL, spp=SPP)
            pictures.append(read_image(path))
            labels.append(f"{method_of(run).name}: {texture.about['text']}")
    write_image(SHEET, sheet(pictures, columns=COLUMNS, labels=labels, cell=CELL))
    print(SHEET)


if __name__ == "__main__":
    main()
