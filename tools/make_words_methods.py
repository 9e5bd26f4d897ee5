"""Draws docs/gallery/words-methods.jpg: textures from words on one mesh, by methods.

usage: python tools/make_words_methods.py MESH RUN [RUN ...] [--out FILE]

A RUN is of a fit from words; three are in a row. Reliefs are shown.
"""

from __future__ import annotations

import argparse
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--out", type=Path, default=SHEET)
    arguments = parser.parse_args()
    surface, pictures, labels = Mesh.load(arguments.mesh), [], []
    with TemporaryDirectory() as folder:
        for run in arguments.runs:
            texture, path = load(run), Path(folder) / "a.png"
            options = {"displace": True} if isinstance(texture, NcaTexture) else {}
            texture.apply(surface, **options).render(path, resolution=CELL, spp=SPP)
            pictures.append(read_image(path))
            labels.append(f"{method_of(run).name}: {texture.about['text']}")
    print(write_image(arguments.out, sheet(pictures, columns=COLUMNS, labels=labels, cell=CELL)))


if __name__ == "__main__":
    main()
