"""Synthesizes surface textures on meshes and renders them, the exemplar beside them.

usage: python tools/make_surface_gallery.py EXEMPLARS MESHES RUNS SHEET MESH=EXEMPLAR ... [KEY=VALUE ...]

EXEMPLARS and MESHES are folders (embedded names work too), RUNS is where the run folders go: finished ones
are used again, begun ones go on. The sheet goes to docs/gallery/SHEET.jpg, a row for each MESH=EXEMPLAR: the
exemplar, and the mesh from two sides. Words whose left side is a setting change the synthesis
(`resolution=512`, `pictures=1`, ...). Only the albedo is synthesized with `maps=albedo`.
"""

from __future__ import annotations

import math
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np

from mitex.exemplar import Exemplar
from mitex.exemplar import names as exemplar_names
from mitex.images import write_image
from mitex.mesh import Mesh, embedded_names
from mitex.methods import surface
from mitex.methods.surface.texture import NAME
from mitex.render import sheet, still, tone
from mitex.training import checkpoint

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
SIDES = (20, 200)  # azimuths [degrees]
CELL = 320


def texture(exemplar: Exemplar, mesh: Mesh, run: Path, settings: list[str]) -> surface.SurfaceTexture:
    """The texture in a run folder, synthesized if it is not there yet."""
    if (run / NAME).is_file():
        return surface.SurfaceTexture.load(run)
    return surface.fit(exemplar, mesh, run, overrides=settings, resume=(run / checkpoint.NAME).is_file())


def row(exemplar: Exemplar, made: surface.SurfaceTexture) -> list[np.ndarray]:
    """The exemplar and the mesh from all `SIDES`."""
    asset = made.apply()
    shown = [tone(still(asset, resolution=CELL, spp=64, azimuth=math.radians(a))) for a in SIDES]
    return [exemplar.resized(CELL).maps["albedo"], *shown]


def main() -> None:
    exemplars, meshes, runs, name = Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4]
    keys = {field.name for field in fields(surface.SurfaceConfig)} | {"maps"}
    words = [word.split("=") for word in sys.argv[5:]]
    settings = {key: value for key, value in words if key in keys}
    maps = settings.pop("maps", None)
    cells, labels = [], []
    for mesh_name, exemplar_name in (pair for pair in words if pair[0] not in keys):
        mesh = Mesh.load(mesh_name if mesh_name in embedded_names() else meshes / f"{mesh_name}.obj")
        known = exemplar_name in exemplar_names()
        exemplar = Exemplar.load(exemplar_name if known else exemplars / exemplar_name)
        if maps is not None:
            exemplar = Exemplar({key: exemplar.maps[key] for key in maps.split(",")}, exemplar.name)
        overrides = [f"{key}={value}" for key, value in settings.items()]
        made = texture(exemplar, mesh, runs / f"{name}-{mesh_name}-{exemplar_name}", overrides)
        cells += row(exemplar, made)
        labels += [f"exemplar {exemplar.name}", mesh.name, f"{mesh.name}, other side"]
    write_image(GALLERY / f"{name}.jpg", sheet(cells, columns=1 + len(SIDES), labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
