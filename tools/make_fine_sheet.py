"""Shows how the preset `fine` of geometric textures works: two sheets in docs/gallery.

usage: python tools/make_fine_sheet.py RUNS FINE[,...] REFERENCE ...

geometric-blur.jpg shows references behind the low-pass filter of each level of training meshes. RUNS holds a
finished run of `mitex fit geometric --preset fine` for each reference of FINE: geometric-coarse.jpg has a row
for each, with the reference, the coarse part of its relief, what the generators complete it to, that part
laid anew, and what they complete that to.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_geometric_gallery import CELL, GALLERY, picture

from mitex.images import write_image
from mitex.mesh.low_pass import blurred
from mitex.methods.geometric import GeometricTexture
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.template import find_template, normalised
from mitex.render import sheet

LEVELS = range(2, 6)


def blurs(names: list[str]) -> np.ndarray:
    """A row for each reference: as each level can show it."""
    cells, labels = [], []
    for name in names:
        reference = find_reference(name)
        reference, _ = normalised(reference, find_template(reference))
        cells += [picture(blurred(reference, 0.5**level)) for level in LEVELS]
        labels += [f"{name}, level {level}" for level in LEVELS]
    return sheet(cells, columns=len(LEVELS), labels=labels, cell=CELL)


def completions(runs: Path, names: list[str]) -> np.ndarray:
    """A row for each run: reference, coarse part and its completion, one laid anew and its completion."""
    cells, labels = [], []
    for name in names:
        texture = GeometricTexture.load(runs / name)
        base, coarse = texture.template, texture.coarse
        if coarse is None:
            raise SystemExit(f"{runs / name} was not trained with the preset `fine`")
        shapes = {
            name: find_reference(name),
            "coarse part": base.with_vertices(base.vertices + texture.fixed.numpy()),
            "completed": texture.generate(start_level=texture.levels),
            "laid anew": base.with_vertices(coarse.on(base)(0)),
            "anew, completed": texture.generate(0),
        }
        cells += [picture(mesh) for mesh in shapes.values()]
        labels += list(shapes)
    return sheet(cells, columns=5, labels=labels, cell=CELL)


def main() -> None:
    runs, fine, *names = sys.argv[1:]
    write_image(GALLERY / "geometric-blur.jpg", blurs(names))
    write_image(GALLERY / "geometric-coarse.jpg", completions(Path(runs), fine.split(",")))


if __name__ == "__main__":
    main()
