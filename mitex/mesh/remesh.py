"""Isotropic remeshing and simplification, through PyMeshLab (extra `remesh`)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from mitex.errors import MeshError, MeshWarning
from mitex.mesh.mesh import Mesh
from mitex.mesh.subdivide import subdivide_midpoint
from mitex.mesh.validate import validate
from mitex.optional import optional
from mitex.progress import announce
from mitex.ranges import EVEN_VERTICES

ROUNDS = 4  # tries to meet the number of vertices
CLOSE_ENOUGH, FAR_OFF = 0.03, 0.2  # of it, as logarithms
# Equal edges that are all split or collapsed at once make the count jump; in a finer source they are not.
FINER = 2
# Measured: what the remesher makes of a wanted edge length is this much longer.
LONGER = 1.04


def remesh(mesh: Mesh, vertices: int, feature_angle: float = 60.0) -> Mesh:
    """Replaces the triangles by nearly equilateral ones of one size, as the MeshNCA paper asks for.

    Explicit isotropic remeshing (Botsch and Kobbelt 2004) with an edge length that is corrected until the
    count is within about 3 % of what was asked, or as near as four tries come. Edges along curved borders
    and creases stay: where they are too many, a `MeshWarning` tells the count. UVs are lost. Takes seconds.

    Args:
        mesh: any mesh.
        vertices: wanted number of vertices, at least 12.
        feature_angle: edges where the surface bends by more than this stay [degrees].

    Returns:
        A new mesh of the same name in the same place.

    Raises:
        MeshError: PyMeshLab failed, or too few vertices are asked for.
        MissingPackage: PyMeshLab is not installed.
    """
    fewest = EVEN_VERTICES[0]
    if vertices < fewest:
        raise MeshError(f"{vertices} vertices are too few for remeshing", f"ask for {fewest} or more")
    area = float(mesh.face_areas.sum(dtype=np.float64))
    length = math.sqrt(2.0 * area / (math.sqrt(3.0) * vertices)) / LONGER
    source = mesh
    while len(source.vertices) < FINER * vertices:
        source = subdivide_midpoint(source)
    best, best_error = mesh, math.inf
    for _ in range(ROUNDS):
        candidate = _isotropic(source, length, feature_angle)
        ratio = len(candidate.vertices) / vertices
        if abs(math.log(ratio)) < best_error:
            best, best_error = candidate, abs(math.log(ratio))
        if best_error < CLOSE_ENOUGH:
            break
        length *= math.sqrt(ratio)
    if best_error > FAR_OFF:
        warnings.warn(
            f"{mesh.name} has {len(best.vertices):,} vertices after remeshing, not {vertices:,}: edges along "
            "curved borders and creases stay",
            MeshWarning,
            stacklevel=2,
        )
    return best


def simplified(mesh: Mesh, faces: int) -> Mesh:
    """A coarse mesh of the same topology: quadric edge collapse (Garland and Heckbert 1997).

    Args:
        mesh: any mesh.
        faces: wanted; there are more if the topology needs them.

    Raises:
        MeshError: PyMeshLab failed.
        MissingPackage: PyMeshLab is not installed.
    """

    def collapse(meshes: Any) -> None:
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=faces, preservetopology=True, preserveboundary=True, preservenormal=True
        )

    return _filtered(mesh, collapse)


def _isotropic(mesh: Mesh, length: float, feature_angle: float) -> Mesh:
    def remeshed(meshes: Any) -> None:
        meshes.meshing_isotropic_explicit_remeshing(
            iterations=12,
            targetlen=optional("pymeshlab", "remesh").PureValue(length),
            featuredeg=feature_angle,
        )

    return _filtered(mesh, remeshed)


def _filtered(mesh: Mesh, change: Callable[[Any], None]) -> Mesh:
    """The mesh after a filter of PyMeshLab."""
    pymeshlab = optional("pymeshlab", "remesh")
    announce(f"remeshing {mesh.name}")
    meshes = pymeshlab.MeshSet(verbose=False)
    try:
        meshes.add_mesh(pymeshlab.Mesh(mesh.vertices.astype(np.float64), mesh.faces))
        change(meshes)
        result = meshes.current_mesh()
        points, faces = result.vertex_matrix(), result.face_matrix()
    except pymeshlab.PyMeshLabException as error:
        reason = " ".join(str(error).split())
        raise MeshError(f"{mesh.name} could not be remeshed ({reason})", "repair it in a modeller") from error
    return validate(points, faces, name=mesh.name)
