"""Meshes: loading, checking, shapes, subdivision, remeshing, quality."""

from mitex.mesh.embedded import embedded, embedded_names
from mitex.mesh.lattice import Lattice
from mitex.mesh.mesh import Mesh, Similarity
from mitex.mesh.quality import QualityReport, quality
from mitex.mesh.remesh import remesh
from mitex.mesh.shapes import grid, icosphere, scattered_sphere, torus
from mitex.mesh.subdivide import subdivide_loop, subdivide_midpoint
from mitex.mesh.topology import EdgeGraph
from mitex.mesh.validate import validate

__all__ = [
    "EdgeGraph",
    "Lattice",
    "Mesh",
    "QualityReport",
    "Similarity",
    "embedded",
    "embedded_names",
    "grid",
    "icosphere",
    "quality",
    "remesh",
    "scattered_sphere",
    "subdivide_loop",
    "subdivide_midpoint",
    "torus",
    "validate",
]
