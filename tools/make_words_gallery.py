"""Draws docs/gallery/words-textures.jpg: textures from words on a sphere and on meshes that they never saw.

usage: python tools/make_words_gallery.py MESH[,MESH ...] RUN [RUN ...] [--columns N]

A RUN is a texture of `mitex fit nca --text`; it has a row, or a part of one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mitex.images import write_image
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture
from mitex.render import sheet, still, tone

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "words-textures.jpg"
CELL, SPP = 224, 24  # side of a picture [px], and paths of a pixel


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("meshes")
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--columns", type=int, help="pictures in a row; by default the surfaces of a texture")
    parser.add_argument("--out", type=Path, default=SHEET)
    options = parser.parse_args()
    surfaces = [icosphere(32), *(Mesh.load(mesh) for mesh in options.meshes.split(","))]
    pictures, labels = [], []
    for run in options.runs:
        texture = NcaTexture.load(run)
        for surface in surfaces:
            asset = texture.apply(surface, resolution=None, keep_dense=True)
            pictures.append(tone(still(asset, resolution=CELL, spp=SPP)))
        labels += [str(texture.about["text"]), *[""] * (len(surfaces) - 1)]
    columns = options.columns or len(surfaces)
    print(write_image(options.out, sheet(pictures, columns=columns, labels=labels, cell=CELL)))


if __name__ == "__main__":
    main()
