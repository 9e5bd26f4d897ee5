"""Draws docs/gallery/words-relief.jpg: spheres that the reliefs of textures from words have moved, in their
colours, and in clay below.

usage: python tools/make_words_relief.py RUN [RUN ...]

A RUN is a texture of `mitex fit nca --text`. How much its heights vary stands over it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mitex.asset import clay
from mitex.images import write_image
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture
from mitex.render import sheet, still, tone

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "words-relief.jpg"
CELL, SPP = 288, 32  # side of a picture [px], and paths of a pixel
FREQUENCY = 48  # of the sphere


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--out", type=Path, default=SHEET)
    options = parser.parse_args()
    coloured, plain, labels = [], [], []
    for run in options.runs:
        texture = NcaTexture.load(run)
        flat = texture.apply(icosphere(FREQUENCY), resolution=None, keep_dense=True)
        moved = texture.apply(icosphere(FREQUENCY), resolution=None, keep_dense=True, displace=True)
        coloured.append(tone(still(moved, resolution=CELL, spp=SPP, floating=True)))
        plain.append(tone(still(clay(moved.mesh), resolution=CELL, spp=SPP, floating=True)))
        edges = 2 * float(texture.about["relief"]) * flat.vertex_maps["height"].std()
        labels.append(f"{edges:.2f} edges")
    labels += [""] * len(plain)
    print(write_image(options.out, sheet(coloured + plain, columns=len(plain), labels=labels, cell=CELL)))


if __name__ == "__main__":
    main()
