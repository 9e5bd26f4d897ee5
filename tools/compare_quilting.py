"""Compares textures joined on a mesh with such that are laid over its UVs: seams, and close-ups.

usage: python tools/compare_quilting.py RUNS MESHES SHEET NAME[,NAME...] MESH ...

RUNS holds a finished run of `mitex fit nerf` for each NAME; meshes are named as for make_surface_gallery.py.
docs/gallery/SHEET.jpg has a row for each texture and mesh: laid over the UVs and joined on the surface, whole
and at a border of charts. The seam ratios of the latent features are printed, at the borders of the charts
that the texture in the plane follows.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np
from make_surface_gallery import find_mesh

from mitex.evaluation.seams import ratio_across
from mitex.images import write_image
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.use.applied import AppliedTexture
from mitex.render import sheet, tone
from mitex.render.framing import rotation
from mitex.render.shell import shell_still

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL, SPP = 240, 6  # side of a picture [px], samples
AZIMUTH, ELEVATION = -30.0, 18.0  # of the camera [degrees]
CLOSE = 0.16  # of a close-up [extents of the mesh]
PATCHES = 300
SCALE = 2.0  # of elements, so that single strands are seen


def seams(field: AppliedTexture, plane: AppliedTexture, gap: float) -> float:
    """How much more features change where the charts of the plane's texture end than elsewhere."""
    uv = plane.mesh.uv
    assert uv is not None
    return ratio_across(field.projection.mesh, np.asarray(uv), field.features_at, gap)


def border(field: AppliedTexture) -> np.ndarray:
    """(3,) the place on a border of charts that the camera sees best."""
    mesh = field.mesh
    assert mesh.uv is not None
    towards = np.array([0.0, math.sin(math.radians(ELEVATION)), math.cos(math.radians(ELEVATION))])
    towards = towards @ rotation(math.radians(AZIMUTH))
    corners, uv = mesh.faces.ravel(), np.asarray(mesh.uv).reshape(-1, 2)
    spread = [np.bincount(corners, column, len(mesh.vertices)) for column in (*uv.T, *(uv**2).T)]
    count = np.maximum(np.bincount(corners, minlength=len(mesh.vertices)), 1)
    variance = sum(spread[k + 2] / count - (spread[k] / count) ** 2 for k in (0, 1))
    centre = mesh.vertices.mean(0)
    away = (
        np.linalg.norm(np.cross(mesh.vertices - centre, towards), axis=1)
        / np.ptp(mesh.vertices, axis=0).max()
    )
    score = np.where(
        variance > 1e-4, mesh.normals @ towards - away + (mesh.vertices - centre) @ towards, -np.inf
    )
    return mesh.vertices[score.argmax()]


def picture(field: AppliedTexture, outline: np.ndarray, floating: bool) -> np.ndarray:
    """In the studio."""
    options = {"resolution": CELL, "spp": SPP, "azimuth": AZIMUTH, "elevation": ELEVATION}
    return tone(shell_still(field, field.similarity, outline, floating=floating, **options))


def main() -> None:
    runs, meshes, name, textures, *targets = sys.argv[1:]
    cells, labels = [], []
    for texture_name in textures.split(","):
        texture = NerfTexture.load(Path(runs) / texture_name)
        maps = texture.synthesize(512, seed=0, tileable=True, patches=PATCHES)
        for target in targets:
            mesh = find_mesh(target, Path(meshes))
            plane = texture.apply(mesh, maps, scale=SCALE)
            start = time.perf_counter()
            own = texture.synthesize_on(mesh, patches=PATCHES, scale=SCALE)
            surface = texture.apply(*own, scale=SCALE)
            seconds = time.perf_counter() - start
            ratios = [seams(field, plane, SCALE * maps.gap) for field in (plane, surface)]
            print(
                f"{texture_name} on {target}: seam ratio {ratios[0]:.2f} laid over the UVs, {ratios[1]:.2f} "
                f"joined on the surface, in {seconds:.0f} s",
                flush=True,
            )
            place = border(plane)
            near = np.linalg.norm(plane.outline - place, axis=1) < CLOSE * np.ptp(mesh.vertices, axis=0).max()
            for label, field in (("over the UVs", plane), ("on the surface", surface)):
                cells += [picture(field, field.outline, False), picture(field, plane.outline[near], True)]
                labels += [f"{texture_name}, {label}", "at a border of charts"]
            write_image(GALLERY / f"{name}.jpg", sheet(cells, columns=4, labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
