"""How well a mesh suits a texture that grows along its edges."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mitex.mesh.mesh import Mesh
from mitex.mesh.topology import boundary_loops, components, euler_characteristic, mesh_edges, opposed_edges

# Vertices of the paper's training sphere (an icosphere of frequency 64).
PAPER_VERTICES = 40_962
UNEVEN = 0.35
MIN_MEAN_VALENCE = 5.5
MAX_ODD_VALENCE = 0.15


@dataclass(frozen=True)
class QualityReport:
    """Numbers and advice.

    Attributes:
        vertices, faces: counts.
        valence: smallest, mean and largest number of neighbours of a vertex.
        odd_valence: part of the inner vertices whose valence is below 5 or above 7, in [0, 1].
        edge_length: mean [mesh units].
        edge_variation: standard deviation of the edge length divided by its mean.
        components: connected pieces.
        boundary_edges, non_manifold_edges: edges of one face, and of more than two.
        euler: V - E + F.
        genus: handles, all components together; None if not manifold or not orientable.
        subdivisions: rounds of subdivision that bring the vertex count closest to the training sphere's.
        advice: one sentence each; empty if there is nothing to improve.
    """

    vertices: int
    faces: int
    valence: tuple[int, float, int]
    odd_valence: float
    edge_length: float
    edge_variation: float
    components: int
    boundary_edges: int
    non_manifold_edges: int
    euler: int
    genus: int | None
    subdivisions: int
    advice: tuple[str, ...]


def quality(mesh: Mesh, target: int = PAPER_VERTICES) -> QualityReport:
    """Measures a mesh and says what would help.

    The MeshNCA paper trains on a sphere of 40,962 vertices and asks for meshes with nearly uniform edges and
    valences near 6; patterns have a fixed size in edges, so the vertex density decides how large they appear.

    Args:
        mesh: any mesh.
        target: number of vertices that the density is compared with.
    """
    count = len(mesh.vertices)
    pairs, sides = mesh_edges(mesh.faces, count)
    lengths = np.linalg.norm(
        mesh.vertices[pairs[:, 0]].astype(np.float64) - mesh.vertices[pairs[:, 1]], axis=1
    )
    valence = mesh.edges.valence
    inner = np.ones(count, bool)
    inner[pairs[sides == 1]] = False
    odd = ((valence < 5) | (valence > 7))[inner]
    euler = euler_characteristic(mesh.faces, count)
    pieces = components(mesh.edges)[0]
    mean_length = float(lengths.mean()) if len(lengths) else 0.0
    numbers = {
        "vertices": count,
        "faces": len(mesh.faces),
        "valence": (int(valence.min()), float(valence.mean()), int(valence.max())),
        "odd_valence": float(odd.mean()) if len(odd) else 0.0,
        "edge_length": mean_length,
        "edge_variation": float(lengths.std() / mean_length) if mean_length else 0.0,
        "components": pieces,
        "boundary_edges": int((sides == 1).sum()),
        "non_manifold_edges": int((sides > 2).sum()),
        "euler": euler,
        "genus": _genus(mesh, euler, pieces, bool((sides > 2).any())),
        "subdivisions": max(0, round(math.log(target / count, 4.0))),
    }
    report = QualityReport(**numbers, advice=())
    return QualityReport(**numbers, advice=tuple(_advice(report, target)))


def _genus(mesh: Mesh, euler: int, pieces: int, non_manifold: bool) -> int | None:
    """From V - E + F = 2 pieces - 2 genus - boundary loops."""
    count = len(mesh.vertices)
    if non_manifold or opposed_edges(mesh.faces, count):
        return None
    twice = 2 * pieces - euler - boundary_loops(mesh.faces, count)
    return twice // 2 if twice >= 0 and twice % 2 == 0 else None


def _advice(report: QualityReport, target: int) -> Iterator[str]:
    uneven = report.edge_variation > UNEVEN
    irregular = report.valence[1] < MIN_MEAN_VALENCE or report.odd_valence > MAX_ODD_VALENCE
    if uneven or irregular:
        flaws = []
        if uneven:
            flaws.append(f"edge lengths vary by {report.edge_variation:.0%} (uniform ones are best)")
        if irregular:
            flaws.append(
                f"{report.odd_valence:.0%} of the vertices have fewer than 5 or more than 7 neighbours, "
                f"{report.valence[1]:.1f} in the mean (6 is best)"
            )
        yield (
            f"{' and '.join(flaws)}: remesh with mitex.mesh.remesh(mesh, {target // 4}) "
            "(extra mitex[remesh]), or patterns will be stretched and uneven"
        )
    if report.subdivisions:
        after = report.vertices * 4**report.subdivisions
        yield (
            f"{report.vertices:,} vertices are fewer than the {target:,} of the training sphere: subdivide "
            f"{report.subdivisions} time{'s' if report.subdivisions > 1 else ''} (about {after:,} vertices), "
            f"or patterns come out {math.sqrt(target / report.vertices):.1f} times as large"
        )
    elif report.vertices > 2 * target:
        yield (
            f"{report.vertices:,} vertices are many more than the {target:,} of the training sphere: remesh "
            f"with mitex.mesh.remesh(mesh, {target}), or patterns come out "
            f"{math.sqrt(report.vertices / target):.1f} times as small"
        )
    if report.components > 1:
        yield f"separate components: {report.components:,}; join them if the pattern shall run through"
    if report.non_manifold_edges:
        yield f"edges of more than two faces: {report.non_manifold_edges:,}; repair them in a modeller"
