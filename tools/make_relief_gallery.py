"""Renders reliefs from pictures beside what they began with, and measures both.

usage: python tools/make_relief_gallery.py EXEMPLAR=MESH=RUN ...

RUN is a finished run of `mitex fit relief` for that exemplar and mesh. docs/gallery/relief.jpg has a row for
each: the exemplar's maps, the mesh as it began (with the heights of surface, or plain with start=flat), the
relief in grey, and with its colours. Printed are, before and after the fit, the distance of form from a plane
with the exemplar's heights (`mitex.evaluation.form`; 1 is a bare plane), and the pairs of faces that pierce
each other.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from mitex.asset import clay
from mitex.evaluation.form import ReliefForm
from mitex.exemplar import Exemplar
from mitex.images import bilinear, write_image
from mitex.mesh import Mesh, grid
from mitex.mesh.self_intersections import piercing_pairs
from mitex.methods.relief import PRESETS, ReliefConfig, ReliefTexture
from mitex.methods.relief.depth import with_depth
from mitex.methods.relief.maps import synthesized
from mitex.methods.relief.start import Start
from mitex.render import sheet, still, tone
from mitex.training.config import resolve
from mitex.training.control import ALONE

SHEET = Path(__file__).parents[1] / "docs" / "gallery" / "relief.jpg"
CELL = 280  # side of a picture [px]
AZIMUTH = 20  # [degrees]
TILES, CELLS = 2, 320  # of the exemplar beside each other, and faces along them


def plane(exemplar: Exemplar, depth: float) -> Mesh:
    """A plane with the exemplar's relief [widths]."""
    flat = grid(CELLS, CELLS)
    places = TILES * 0.5 * (flat.vertices[:, :2] + 1)
    heights = bilinear(exemplar.maps["height"], places % 1)[:, 0]
    return Mesh(np.column_stack([places, depth * heights]), flat.faces)


def started(exemplar: Exemplar, depth: float, mesh: Mesh, config: ReliefConfig) -> Mesh:
    """What a fit begins with; the maps come from the cache."""
    if config.start == "flat":
        return mesh
    start = Start.of_maps(synthesized(exemplar, mesh, config, False, ALONE, True), config)
    offsets = depth * start.exemplar_width(config) * start.heights[:, None] * start.fine.normals
    return start.fine.with_vertices(start.fine.vertices + offsets)


def beside(exemplar: Exemplar) -> np.ndarray:
    """Its heights above its normals, left of its colours if there are any."""
    maps = exemplar.resized(CELL // 2).maps
    columns = np.concatenate([maps["height"].repeat(3, 2), maps["normal"]])
    rest = np.ones((CELL, CELL - columns.shape[1], 3), np.float32)
    if "albedo" in maps:
        rest[: CELL // 2, : CELL // 2] = maps["albedo"]
    return np.concatenate([columns, rest], axis=1)


def main() -> None:
    cells, labels = [], []
    for word in sys.argv[1:]:
        name, place, run = word.split("=")
        texture, mesh = ReliefTexture.load(run), Mesh.load(place)
        config = resolve(PRESETS, None, Path(run) / "config.toml", {})
        exemplar, depth = with_depth(Exemplar.load(name), config.depth)
        before, form = started(exemplar, depth, mesh, config), ReliefForm(plane(exemplar, depth))
        for label, result in (("began with", before), ("relief", texture.moved)):
            measured, pairs = form.of(result), len(piercing_pairs(result))
            print(
                f"{exemplar.name} on {mesh.name}, {label}: form {measured.distance:.3f} at {measured.size}, "
                f"{len(result.faces):,} faces, {pairs:,} pairs pierce each other",
                flush=True,
            )
        cells.append(beside(exemplar))
        for asset in (clay(before), clay(texture.moved), texture.apply()):
            cells.append(tone(still(asset, resolution=CELL, spp=96, azimuth=AZIMUTH)))
        labels += [exemplar.name, "began with", "relief", "with its colours"]
    write_image(SHEET, sheet(cells, columns=4, labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
