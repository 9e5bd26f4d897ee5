"""Shows captured textures: views, what is synthesized, and other shapes that wear them.

usage: python tools/make_nerf_gallery.py RUNS CAPTURES MESHES SHEET NAME[,NAME...] MESH ...

RUNS holds a finished run of `mitex fit nerf` for each NAME, CAPTURES its photos, MESHES is a folder; meshes
are named as for make_surface_gallery.py. docs/gallery/SHEET.jpg has a row for each texture: a photo that was
held out, the same view of the field, the texture synthesized as a plane, at three elevations, and the meshes,
on which patches are joined.
The quality of all held-out views is printed.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from make_surface_gallery import find_mesh

from mitex.evaluation.views import view_quality
from mitex.images import write_image
from mitex.mesh import Mesh
from mitex.mesh.shapes import grid
from mitex.methods.nerf import NerfTexture, load_capture
from mitex.methods.nerf.field.rendering import render_view, render_views
from mitex.methods.nerf.use.applied import AppliedTexture
from mitex.render import sheet, tone
from mitex.render.shell import shell_still

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL = 256  # side of a picture [px]
SPP = 16
ELEVATIONS = (80, 45, 15)  # of the camera above the plane [degrees]


def plane(side: int = 64) -> Mesh:
    """A square with its UVs, lying on the floor."""
    flat = grid(side, side)
    return flat.with_vertices(flat.vertices[:, [0, 2, 1]] * np.array([1.0, 1.0, -1.0]))


def picture(applied: AppliedTexture, elevation: float) -> np.ndarray:
    """In the studio."""
    return tone(
        shell_still(
            applied,
            applied.similarity,
            applied.outline,
            resolution=CELL,
            spp=SPP,
            elevation=elevation,
        )
    )


def main() -> None:
    runs, captures, meshes, name, textures, *targets = sys.argv[1:]
    cells, labels = [], []
    for texture_name in textures.split(","):
        texture = NerfTexture.load(Path(runs) / texture_name)
        _, held_out = load_capture(Path(captures) / texture_name).within(texture.similarity).split()
        for across in (1, 2):
            quality = view_quality(render_views(texture.shell, held_out, across=across))
            print(f"{texture_name}, {across} x {across} rays a pixel: {quality}", flush=True)
        image, photo = render_view(texture.shell, held_out, 0)
        start = time.perf_counter()
        maps = texture.synthesize(1024, seed=0, tileable=True)
        print(f"{texture_name}: synthesized in {time.perf_counter() - start:.0f} s", flush=True)
        cells += [photo, image]
        labels += [f"{texture_name}, held out", "seen"]
        flat = texture.apply(plane(), maps)
        cells += [picture(flat, elevation) for elevation in ELEVATIONS]
        labels += [f"from {elevation} degrees" for elevation in ELEVATIONS]
        for mesh in targets:
            start = time.perf_counter()
            cells.append(picture(texture.apply(find_mesh(mesh, Path(meshes))), 18))
            labels.append(mesh.split("~")[0])
            print(f"{texture_name} on {mesh}: {time.perf_counter() - start:.0f} s", flush=True)
    columns = 2 + len(ELEVATIONS) + len(targets)
    write_image(GALLERY / f"{name}.jpg", sheet(cells, columns=columns, labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
