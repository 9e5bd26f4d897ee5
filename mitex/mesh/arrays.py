"""A mesh as named arrays, as model files keep it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mitex.mesh.mesh import Mesh
from mitex.mesh.polygons import Polygons

VALUES = ("vertices", "faces", "uv", "corner_normals")
OF_POLYGONS = ("sizes", "triangles", "vertices")


def mesh_arrays(mesh: Mesh) -> dict[str, np.ndarray]:
    """The arrays that a mesh and its polygons have, under the names of their attributes."""
    arrays = {name: getattr(mesh, name) for name in VALUES}
    if mesh.polygons is not None:
        arrays |= {f"polygon_{name}": getattr(mesh.polygons, name) for name in OF_POLYGONS}
    return {name: values for name, values in arrays.items() if values is not None}


def mesh_of_arrays(arrays: Mapping[str, np.ndarray], name: str) -> Mesh:
    """The mesh of `mesh_arrays`.

    Raises:
        MeshError: the arrays do not fit each other.
        KeyError: there are no vertices or faces.
    """
    polygons = None
    if "polygon_sizes" in arrays:
        sizes, triangles = arrays["polygon_sizes"], arrays["polygon_triangles"]
        polygons = Polygons(sizes, triangles, arrays.get("polygon_vertices"))
    normals = arrays.get("corner_normals")
    return Mesh(arrays["vertices"], arrays["faces"], arrays.get("uv"), name, normals, polygons)
