"""Grows a relief with a direction on meshes, along a field and across it, beside one that learned none.

usage: python tools/make_direction_sheet.py RUNS MESHES SHEET REFERENCE MESH~FACES ...

RUNS holds two runs of `mitex fit geometric` of as many steps: REFERENCE was given the field `up`, and
REFERENCE-blind none. Meshes are named as for make_surface_gallery.py; each is displaced from level 2 on.
docs/gallery/SHEET.jpg has a row for each mesh: the reference or the mesh itself, the relief along that field,
along the field turned by 90 degrees, and without one. For every result the angle of its ridges from `up`
is printed, with the mean angle between ridges and the field that was told.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_geometric_gallery import picture
from make_surface_gallery import find_mesh

from mitex.evaluation.relief_direction import relief_direction
from mitex.images import write_image
from mitex.mesh import Mesh, subdivide_midpoint
from mitex.mesh.fields import vector_field
from mitex.methods.geometric import GeometricTexture
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.texture import START
from mitex.render import sheet

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL = 224  # side of a picture [px]


def grown(texture: GeometricTexture, mesh: Mesh, field: str, turned: bool) -> Mesh:
    """The relief on a mesh, along the field `up`, across it, or without one; its directions are printed."""
    told = vector_field(mesh, "up")
    told = np.cross(mesh.normals, told) if turned else told
    relief = texture.apply(mesh, field=told if texture.about.get("field") else None).mesh
    base = subdivide_midpoint(mesh, texture.levels - 1 - START)
    up = vector_field(base, "up")
    angles = [relief_direction(base, relief, along) for along in (up, np.cross(base.normals, up))]
    print(
        f"{field} on {mesh.name}: {len(relief.faces):,} faces, ridges {angles[0].turn:.0f} degrees from up, "
        f"coherence {angles[0].coherence:.2f}; off the field by {angles[turned].error:.0f} on average",
        flush=True,
    )
    return relief


def main() -> None:
    runs, meshes, name, reference, *words = sys.argv[1:]
    directed, blind = (GeometricTexture.load(Path(runs) / run) for run in (reference, f"{reference}-blind"))
    cells, labels = [picture(find_reference(reference))], [reference, "up", "turned", "no field"]
    for k, word in enumerate(words):
        mesh = find_mesh(word, Path(meshes))
        if k:
            original = find_mesh(word.split("~")[0], Path(meshes))
            cells.append(picture(original))
            labels += [original.name, "", "", ""]
        for field, texture in (("up", directed), ("turned", directed), ("no field", blind)):
            cells.append(picture(grown(texture, mesh, field, field == "turned")))
    write_image(GALLERY / f"{name}.jpg", sheet(cells, columns=4, labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
