"""Grows geometric textures on meshes and renders them, the reference beside them.

usage: python tools/make_geometric_gallery.py RUNS MESHES SHEET REFERENCE[:map][,...] MESH~FACES ...

RUNS holds a finished run of `mitex fit geometric` for each reference, MESHES is a folder; meshes are named as
for make_surface_gallery.py, so that they are remeshed first. Each one is displaced from level 2 on, and
rendered: docs/gallery/SHEET.jpg has a row for each reference, which stands first, and above them the meshes
alone. For every pair the Wasserstein-1 distances between the local statistics of result and reference are
printed, and those of the mesh itself, remeshed to as many vertices as the result has. REFERENCE:map makes a
row of displacement maps.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np
from make_surface_gallery import find_mesh

from mitex.asset import clay
from mitex.images import write_image
from mitex.mesh import Mesh, remesh
from mitex.methods.baselines.displacement import DisplacementMap
from mitex.methods.geometric import GeometricTexture
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.statistics import statistic_distances
from mitex.methods.geometric.texture import START
from mitex.render import sheet, still, tone

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL = 224  # side of a picture [px]
AZIMUTH = math.radians(20)


def picture(mesh: Mesh) -> np.ndarray:
    """From one side, in light grey."""
    return tone(still(clay(mesh), resolution=CELL, spp=96, azimuth=AZIMUTH))


def displaced(texture: GeometricTexture, reference: Mesh, mesh: Mesh, mapped: bool) -> Mesh:
    """The mesh with its texture, or with a displacement map of the reference, features as large."""
    if not mapped:
        return texture.apply(mesh).mesh
    size, _ = texture.relative_size(mesh)
    return DisplacementMap.bake(reference).apply(mesh, size, texture.levels - 1 - START).mesh


def main() -> None:
    runs, meshes, name, references, *wanted = sys.argv[1:]
    found = [find_mesh(word.split("~")[0], Path(meshes)) for word in wanted]
    coarse = [find_mesh(word, Path(meshes)) for word in wanted]
    fine: dict[tuple[str, int], Mesh] = {}
    cells, labels = [np.ones((CELL, CELL, 3)), *map(picture, found)], ["", *(m.name for m in found)]
    for word in references.split(","):
        reference, *mapped = word.split(":")
        texture = GeometricTexture.load(Path(runs) / reference)
        learned = texture.generate(
            start_level=texture.levels
        )  # the reference with edges as long as the results'
        cells.append(picture(find_reference(reference)))
        labels.append(" ".join([reference, *mapped]))
        for mesh, even in zip(found, coarse, strict=True):
            begun = time.perf_counter()
            grown = displaced(texture, find_reference(reference), even, bool(mapped))
            seconds = time.perf_counter() - begun
            key = mesh.name, len(grown.vertices)
            fine.setdefault(key, remesh(mesh, key[1]))
            ours, theirs = statistic_distances(grown, learned), statistic_distances(fine[key], learned)
            told = ", ".join(f"{k} {ours[k]:.3f} of {theirs[k]:.3f}" for k in ours)
            print(f"{word} on {mesh.name}, {len(grown.faces):,} faces, {seconds:.1f} s: {told}", flush=True)
            cells.append(picture(grown))
            labels.append(mesh.name)
    write_image(GALLERY / f"{name}.jpg", sheet(cells, columns=1 + len(found), labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
