"""Grows geometric textures on meshes and renders them, the reference beside them.

usage: python tools/make_geometric_gallery.py RUNS MESHES SHEET ROW[,...] MESH~FACES ...
       python tools/make_geometric_gallery.py RUNS MESHES SHEET REFERENCE:levels MESH~FACES ...

RUNS holds a finished run of `mitex fit geometric` for each reference, MESHES is a folder; meshes are named
as for make_surface_gallery.py, so that they are remeshed first. A ROW is
REFERENCE[@LEVEL][=FIELD][:map|:none]. Each mesh is displaced from LEVEL on (2; of a `fine` one 0), along a
FIELD, and rendered: docs/gallery/SHEET.jpg has a row for each reference, which stands first, and above them
the meshes alone. For every pair the Wasserstein-1 distances between the local statistics of result and
reference are printed, and those of the mesh itself, remeshed to as many vertices as the result has, which
takes minutes for finer results than those of five levels: there they are left out; with a FIELD, how far
ridges are turned from it, too. REFERENCE:map makes a row of displacement maps, REFERENCE:none one without
bumps that are placed (`mitex.methods.geometric.placement`).

REFERENCE:levels makes a sheet of start levels: a row for the reference and each mesh, which stand first, then
what grows from levels 0, 1, 2 and 3 on: on the meshes, and, for the reference, on its own template, whose
lower levels are rebuilt. FACES are those to begin level 2 with; each lower level begins with a quarter as
many, each higher one with four times as many, so that all end alike.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from make_surface_gallery import find_mesh

from mitex.asset import clay
from mitex.evaluation.relief_direction import relief_direction
from mitex.evaluation.surface_statistics import statistic_distances
from mitex.images import write_image
from mitex.mesh import Mesh, remesh, subdivide_midpoint
from mitex.mesh.fields import vector_field
from mitex.methods.baselines.displacement import DisplacementMap
from mitex.methods.geometric import GeometricTexture
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.texture import START
from mitex.render import sheet, still, tone

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL = 224  # side of a picture [px]
LEVELS = range(4)  # to start at, on a sheet of them
LABELS = {"": "{}", "map": "{} map", "none": "{}, none placed"}  # of a row, by its kind
AZIMUTH = 20  # [degrees]
MEASURED = 40_000  # most vertices of a result whose statistics are compared


def picture(mesh: Mesh) -> np.ndarray:
    """From one side, in light grey."""
    return tone(still(clay(mesh), resolution=CELL, spp=96, azimuth=AZIMUTH))


def coarse_mesh(word: str, level: int, meshes: Path) -> Mesh:
    """MESH~FACES with as many faces as growth from a level on begins with."""
    name, faces = word.split("~")
    return find_mesh(f"{name}~{int(4.0 ** (level - START) * int(faces))}", meshes)


def displaced(
    texture: GeometricTexture, reference: Mesh, mesh: Mesh, level: int, field: str | None, kind: str
) -> Mesh:
    """The mesh with its texture, or with a displacement map of the reference, features as large."""
    if kind != "map":
        placement = "none" if kind == "none" else "even"
        return texture.apply(mesh, start_level=level, placement=placement, field=field).mesh
    size, _ = texture.relative_size(mesh)
    return DisplacementMap.bake(reference).apply(mesh, scale=size, subdivide=texture.levels - 1 - START).mesh


def ridges(mesh: Mesh, grown: Mesh, field: str) -> str:
    """Which way they run, on a mesh whose faces were split."""
    while len(mesh.faces) < len(grown.faces):
        mesh = subdivide_midpoint(mesh)
    run = relief_direction(mesh, grown, vector_field(mesh, field))
    return f"ridges {run.turn:.0f} degrees from {field} ({run.coherence:.2f}), {run.error:.0f} on average"


def level_sheet(texture: GeometricTexture, reference: str, meshes: Path, words: list[str]) -> np.ndarray:
    """The sheet of start levels."""
    reconstruction = texture.generate(start_level=texture.levels)
    results = [find_reference(reference), *(texture.generate(start_level=k) for k in LEVELS)]
    for word in words:
        name, _ = word.split("~")
        results.append(find_mesh(name, meshes))
        for k in LEVELS:
            coarse = coarse_mesh(word, k, meshes)
            results.append(texture.apply(coarse, start_level=k).mesh)
            distances = statistic_distances(results[-1], reconstruction)
            summary = ", ".join(f"{key} {d:.3f}" for key, d in distances.items())
            counts = f"{len(coarse.vertices):,} to {len(results[-1].vertices):,} vertices"
            print(f"{reference} on {name} from level {k}, {counts}: {summary}", flush=True)
    names = [reference, *(word.split("~")[0] for word in words)]
    labels = [text for name in names for text in (name, *(f"from level {k}" for k in LEVELS))]
    return sheet([picture(mesh) for mesh in results], columns=1 + len(LEVELS), labels=labels, cell=CELL)


def main() -> None:
    runs, meshes, name, references, *words = sys.argv[1:]
    if references.endswith(":levels"):
        reference = references.removesuffix(":levels")
        image = level_sheet(GeometricTexture.load(Path(runs) / reference), reference, Path(meshes), words)
        write_image(GALLERY / f"{name}.jpg", image)
        return
    originals = [find_mesh(word.split("~")[0], Path(meshes)) for word in words]
    fine: dict[tuple[str, int], Mesh] = {}
    cells, labels = [np.ones((CELL, CELL, 3)), *map(picture, originals)], ["", *(m.name for m in originals)]
    for word in references.split(","):
        row, _, kind = word.partition(":")
        row, _, field = row.partition("=")
        reference, _, start_level = row.partition("@")
        texture = GeometricTexture.load(Path(runs) / reference)
        level = int(start_level or texture.first)
        finer = level + int(texture.about.get("first_level", 0))
        # The reference with edges as long as the results'.
        reconstruction = texture.generate(start_level=texture.levels)
        cells.append(picture(find_reference(reference)))
        labels.append(LABELS[kind].format(f"{reference}, {field}" if field else reference))
        for mesh, mesh_word in zip(originals, words, strict=True):
            even = coarse_mesh(mesh_word, finer, Path(meshes))
            start = time.perf_counter()
            grown = displaced(texture, find_reference(reference), even, level, field or None, kind)
            seconds = time.perf_counter() - start
            print(f"{word} on {mesh.name}, {len(grown.faces):,} faces, {seconds:.1f} s", flush=True)
            key = mesh.name, len(grown.vertices)
            if key[1] <= MEASURED:
                if key not in fine:
                    fine[key] = remesh(mesh, key[1])
                ours, theirs = (statistic_distances(m, reconstruction) for m in (grown, fine[key]))
                print(", ".join(f"{k} {ours[k]:.3f} of {theirs[k]:.3f}" for k in ours), flush=True)
            if field:
                print(ridges(even, grown, field), flush=True)
            cells.append(picture(grown))
            labels.append(mesh.name)
    write_image(GALLERY / f"{name}.jpg", sheet(cells, columns=1 + len(originals), labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
