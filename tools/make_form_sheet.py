"""Renders references beside other reliefs, with the distances of form and of local statistics.

usage: python tools/make_form_sheet.py RUNS SHEET REFERENCE[:map] ... MESH~FACES MESH~FACES

RUNS holds runs of `mitex fit geometric`, by the reference; models that ship with Mitex need none. Meshes are
named as for make_surface_gallery.py, in the folder RUNS/meshes. docs/gallery/SHEET.jpg has a row for each
reference: itself, itself on other triangles, turned and smaller, what grows on the two meshes (with `:map`,
its displacement map), lumps, and a ball. What it prints has the distances of all of them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_surface_gallery import find_mesh

from mitex.asset import clay
from mitex.evaluation.form import ReliefForm
from mitex.evaluation.surface_statistics import statistic_distances
from mitex.images import write_image
from mitex.mesh import Mesh, icosphere, remesh
from mitex.methods.baselines.displacement import DisplacementMap
from mitex.methods.geometric import GeometricTexture
from mitex.methods.geometric.references import find_reference
from mitex.render import sheet, still, tone

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL = 184  # side of a picture [px]
CUT, SMALLER = 12_000, 0.6  # vertices of the reference on other triangles, and its size
FREQUENCY, LUMPS, WIDTH, HEIGHT = 40, 60, 0.17, 0.3  # of the ball, and of the lumps on it [radii]
COARSE = 320  # faces of the template on the level that growth starts at


def lumps() -> Mesh:
    """A ball with lumps at random places, which run into each other."""
    ball, centres = icosphere(FREQUENCY), np.random.default_rng(1).normal(size=(LUMPS, 3))
    points = ball.vertices.astype(np.float64)
    centres /= np.linalg.norm(centres, axis=1, keepdims=True)
    angles = np.arccos(np.clip(points @ centres.T, -1, 1))
    height = HEIGHT * np.tanh(np.exp(-((angles / WIDTH) ** 2)).sum(1))
    return ball.with_vertices(points * (1 + height)[:, None])


def cut(reference: Mesh) -> Mesh:
    """The same surface on other triangles, turned and smaller."""
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    other = remesh(reference, CUT)
    return other.with_vertices(SMALLER * other.vertices @ (turn * np.sign(np.linalg.det(turn))).T)


def grown(runs: Path, reference: str, mesh: Mesh, mapped: bool) -> Mesh:
    """A mesh with the relief, by the network or by a displacement map."""
    if mapped:
        bake = DisplacementMap.bake(find_reference(reference))
        return bake.apply(mesh, scale=(COARSE / len(mesh.faces)) ** 0.5, subdivide=2).mesh
    run = runs / reference
    return GeometricTexture.load(run if run.exists() else reference).apply(mesh).mesh


def main() -> None:
    folder, name, *references, first, second = sys.argv[1:]
    runs, cells, labels = Path(folder), [], []
    meshes = [find_mesh(word, runs / "meshes") for word in (first, second)]
    for word in references:
        reference, _, kind = word.partition(":")
        original = find_reference(reference)
        measure = ReliefForm(original)
        print(f"{reference}, other patches: {measure.at(original, seed=1).distance:.2f}", flush=True)
        reliefs = [grown(runs, reference, mesh, kind == "map") for mesh in meshes]
        names = ["other cut", *(f"on {word.split('~')[0]}" for word in (first, second)), "lumps", "ball"]
        cells.append(original)
        labels.append(reference)
        for label, mesh in zip(names, [cut(original), *reliefs, lumps(), icosphere(FREQUENCY)], strict=True):
            form, local = measure.of(mesh), statistic_distances(mesh, original)
            summary = ", ".join(f"{key} {value:.2f}" for key, value in local.items())
            looks = f"form {form.distance:.2f}, coarse {form.coarse:.2f} at {form.size}"
            print(f"{reference}, {label}: {looks}, {summary}", flush=True)
            cells.append(mesh)
            labels.append(f"{label}: {form.distance:.2f}")
    pictures = [tone(still(clay(mesh), resolution=CELL, spp=96, azimuth=20)) for mesh in cells]
    write_image(GALLERY / f"{name}.jpg", sheet(pictures, columns=6, labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
