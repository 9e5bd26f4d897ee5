"""Grows reliefs on a mesh like one that was scanned: of four times as many faces, rough, and with a hole.

usage: python tools/make_scan_sheet.py MESH [MODEL[=VERTICES] ...]

MESH is split once, its vertices are moved by `ROUGHNESS` edges, and it is cut open at the bottom. Each MODEL
(default: `MODELS`) grows on it, remeshed to so many VERTICES (default: `VERTICES`), as it is and with the
option `untangle`. Writes docs/gallery/geometric-scan.jpg, and prints how many faces, edges at borders and
piercing pairs there are, and the seconds.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mitex.asset import clay
from mitex.images import write_image
from mitex.mesh import Mesh, remesh
from mitex.mesh.self_intersections import piercing_pairs
from mitex.mesh.subdivide import subdivide_midpoint
from mitex.mesh.topology import boundary_edges
from mitex.methods.geometric import GeometricTexture
from mitex.render import sheet, still, tone

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL = 300  # side of a picture [px]
ROUGHNESS = 0.15  # standard deviation of the noise along each axis [mean edges]
CUT = 0.03  # share of the vertices below which faces are taken away
VERTICES = 2_000
MODELS = ("spikes", "scales=16000")  # that of the scales adds no vertices


def scan_like(mesh: Mesh) -> Mesh:
    """The mesh split once, rough, and open at the bottom."""
    fine = subdivide_midpoint(mesh)
    noise = np.random.default_rng(0).normal(size=fine.vertices.shape)
    vertices = fine.vertices + ROUGHNESS * fine.edge_lengths.mean() * noise
    middles = vertices[fine.faces][..., 1].mean(1)
    faces = fine.faces[middles > np.quantile(vertices[:, 1], CUT)]
    used, corners = np.unique(faces, return_inverse=True)
    return Mesh(vertices[used].astype(np.float32), corners.reshape(-1, 3).astype(np.int32), name="scan")


def grown(texture: GeometricTexture, mesh: Mesh, untangle: bool) -> Mesh:
    """The mesh with its relief."""
    return texture.apply(mesh, untangle=untangle).mesh


def reported(label: str, make: Callable[..., Mesh], *arguments: object) -> Mesh:
    """What is made of the arguments, with a line about it."""
    began = time.perf_counter()
    mesh = make(*arguments)
    seconds = time.perf_counter() - began
    border, pairs = len(boundary_edges(mesh.faces, len(mesh.vertices))), len(piercing_pairs(mesh))
    print(
        f"{label}: {len(mesh.faces):,} faces, {border:,} at borders, {pairs:,} pairs, {seconds:.1f} s",
        flush=True,
    )
    return mesh


def main() -> None:
    path, *names = sys.argv[1:]
    scan = reported("scan", scan_like, Mesh.load(path))
    results, labels = [scan], ["a rough mesh, cut open"]
    for word in names or MODELS:
        name, _, vertices = word.partition("=")
        even = reported("remeshed", remesh, scan, int(vertices) if vertices else VERTICES)
        texture = GeometricTexture.load(name)
        for untangle, label in ((False, name), (True, f"{name}, untangled")):
            results.append(reported(label, grown, texture, even, untangle))
            labels.append(label)
    pictures = [tone(still(clay(mesh), resolution=CELL, spp=96, azimuth=20)) for mesh in results]
    write_image(GALLERY / "geometric-scan.jpg", sheet(pictures, len(pictures), labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
