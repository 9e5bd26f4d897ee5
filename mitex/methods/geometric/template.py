"""Where the training meshes start from: a coarse mesh of the reference's topology."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.mesh import Mesh, icosphere, quality, torus
from mitex.mesh.topology import boundary_loops
from mitex.methods.geometric.connectivity import FaceGraph, check_corners
from mitex.methods.geometric.hierarchy import mean_edge

SIDES = 5  # around the tube of a torus
COARSE = 80  # faces of a simplified reference


def find_template(reference: Mesh, template: Mesh | None = None) -> Mesh:
    """The user's template, or one of the reference's topology.

    That is an icosahedron, a torus, or else the reference itself, simplified.

    Args:
        reference: any surface with two sides.
        template: of the user's, or None.

    Raises:
        ConfigError: its topology is not the reference's, the reference's is not that of a surface, or is lost
            when it is simplified.
    """
    expected = topology(reference)
    if template is None:
        if expected == (1, 0, 0):
            return _around(icosphere(1), reference)
        template = _ring(reference) if expected == (1, 1, 0) else _simplified(reference, expected)
    actual = topology(template)
    if actual != expected:
        raise ConfigError(
            f"template {template.name} has {_description(actual)}, "
            f"reference {reference.name} has {_description(expected)}",
            "give a `template` of the same kind",
        )
    return template


def normalised(reference: Mesh, template: Mesh) -> tuple[Mesh, Mesh]:
    """Both meshes centred, and scaled so that they are equally large and the template's mean edge is 1."""
    reference, template = _boxed(reference), _boxed(template)
    graph = FaceGraph.of(template.faces, len(template.vertices))
    unit = float(mean_edge(torch.tensor(template.vertices), graph))
    return reference.with_vertices(reference.vertices / unit), template.with_vertices(
        template.vertices / unit
    )


def topology(mesh: Mesh) -> tuple[int, int, int]:
    """Connected pieces, handles, and pieces of the boundary.

    Raises:
        ConfigError: the mesh is not a surface with two sides.
        MeshError: a face names a vertex twice.
    """
    check_corners(mesh)
    report = quality(mesh)
    if report.genus is None:
        raise ConfigError(
            f"{mesh.name} is not a surface with two sides (non-manifold edges or disagreeing windings)",
            "repair it in a modeller",
        )
    return report.components, report.genus, boundary_loops(mesh.faces, len(mesh.vertices))


def _description(kind: tuple[int, int, int]) -> str:
    return f"{kind[0]} pieces, genus {kind[1]}, {kind[2]} boundaries"


def _boxed(mesh: Mesh) -> Mesh:
    """Its bounding box centred, the longest side from -1 to 1."""
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    return mesh.with_vertices((mesh.vertices - (low + high) / 2) / ((high - low).max() / 2))


def _around(mesh: Mesh, reference: Mesh) -> Mesh:
    """A unit shape stretched to the box of the reference."""
    low, high = reference.vertices.min(0), reference.vertices.max(0)
    return mesh.with_vertices(mesh.vertices * (high - low) / 2 + (low + high) / 2)


def _ring(reference: Mesh) -> Mesh:
    """A coarse torus along the reference: its axis is the direction in which the vertices vary least."""
    centre = reference.vertices.mean(0)
    centred = (reference.vertices - centre).astype(np.float64)
    _, axes = np.linalg.eigh(centred.T @ centred)
    flat = centred @ axes[:, 1:]
    reach = np.linalg.norm(flat, axis=1)
    radius = float(reach.mean())
    tube = float(np.sqrt(np.mean((reach - radius) ** 2 + (centred @ axes[:, 0]) ** 2)))
    edge = 2 * tube * np.sin(np.pi / SIDES)
    rings = max(2 * round(np.pi * radius / (edge * 0.75**0.5)), 4)
    ring = torus(rings, SIDES, radius, min(tube, 0.9 * radius))
    turn = np.stack([axes[:, 1], axes[:, 0], axes[:, 2]], 1)  # the torus has its axis along y
    if np.linalg.det(turn) < 0:
        turn[:, 0] *= -1
    return replace(ring, vertices=ring.vertices @ turn.T + centre)


def _simplified(reference: Mesh, expected: tuple[int, int, int]) -> Mesh:
    """The reference with few faces, and with its topology, or a ConfigError."""
    from mitex.mesh.remesh import simplified

    coarse = simplified(reference, COARSE)
    try:
        kept = topology(coarse) == expected
    except ConfigError:
        kept = False
    if not kept:
        raise ConfigError(
            f"{reference.name}, simplified to {len(coarse.faces)} faces as a template, has another topology, "
            "as where sheets lie on each other",
            "give a `template`",
        )
    return coarse
