"""How much a mesh file may ask for, whatever its size: checked before anything is allocated."""

from __future__ import annotations

from dataclasses import dataclass

from mitex.errors import MeshError

CORNERS_PER_VERTEX = 12  # twice those of a closed triangle mesh
INSTANCES = 100_000  # parts of a scene, each of which costs time even when it is empty
# A generous text line per vertex, normal, UV and two faces, and room for textures in a .glb.
BYTES_PER_VERTEX = 400
BYTES_ALLOWED_ANYWAY = 256 << 20


@dataclass(frozen=True)
class Budget:
    """What a mesh may have.

    Attributes:
        vertices: of all instances together.
    """

    vertices: int

    @property
    def bytes(self) -> int:
        """Of the file and its buffers."""
        return BYTES_ALLOWED_ANYWAY + BYTES_PER_VERTEX * self.vertices

    @property
    def corners(self) -> int:
        """Of all faces."""
        return CORNERS_PER_VERTEX * self.vertices

    def check(self, name: str, *, vertices: int = 0, corners: int = 0, instances: int = 0) -> None:
        """Raises MeshError if a mesh has more than that."""
        for count, most, what in (
            (vertices, self.vertices, "vertices"),
            (corners, self.corners, "corners of faces"),
            (instances, INSTANCES, "parts"),
        ):
            if count > most:
                raise MeshError(
                    f"{name} has {count:,} {what}, more than the budget of {most:,}",
                    "simplify it, or raise max_vertices",
                )
