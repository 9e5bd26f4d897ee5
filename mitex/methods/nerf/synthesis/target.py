"""A surface that is going to be covered with patches: its texels, how it is laid flat, which way is right."""

from __future__ import annotations

import numpy as np

from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.mesh.frames import interpolate_frames, vertex_directions
from mitex.mesh.split import split_long_edges
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.synthesis.flattening import Flattening
from mitex.methods.nerf.synthesis.texels import FaceTexels

FINE = 8  # faces along the side of a patch, at least
EVEN = 20  # and along the mesh
REACH = 0.85  # from the middle of a patch to its corners, and some room for ways along edges [sides]


class Target:
    """A surface for `quilt_on`.

    Attributes:
        mesh: fine enough to be laid flat, on the surface of the given one.
        directions: (V, 3) where the texture's right points at its vertices.
        texels: of the map.
        flattening: lays the surroundings of a point flat.
        patch, gap: as given.

    Args:
        mesh: with a layout in [0, 1] in which nothing overlaps.
        side: of the map on the layout [texels].
        patch: side of a patch [texels].
        gap: between texels of a patch, on the surface [mesh units].
    """

    def __init__(self, mesh: Mesh, side: int, patch: int, gap: float) -> None:
        assert mesh.uv is not None
        extent = float(np.ptp(mesh.vertices, axis=0).max())
        self.mesh = split_long_edges(mesh, min(patch * gap / FINE, extent / EVEN))
        self.directions = vertex_directions(self.mesh)
        self.texels = FaceTexels.rasterize(np.asarray(self.mesh.uv), side)
        self.flattening = Flattening(self.mesh, self.directions, REACH * patch * gap)
        self.patch, self.gap = patch, gap

    @property
    def area(self) -> float:
        """Of a texel of the map, in the mean [texels of a patch]."""
        return float(self.mesh.face_areas.sum()) / (self.gap**2 * max(len(self.texels.index), 1))

    def around(self, texel: int) -> tuple[np.ndarray, np.ndarray]:
        """The texels that a patch covers whose middle lies on one of them.

        Returns:
            (M,) texels, `texel` among them, and (M, 2) float column and row in the patch, in
            [-0.5, patch - 0.5).
        """
        texels, half = self.texels, 0.5 * self.patch
        faces, corners = self.flattening(int(texels.face[texel]), texels.barycentric[texel])
        index, place = texels.of(faces, corners * np.array([1.0, -1.0]) / self.gap)
        inside = (np.abs(place + np.finfo(np.float32).eps) < half).all(1)
        return index[inside], place[inside] + (half - 0.5)

    def in_order(self) -> np.ndarray:
        """(N,) the texels, those that are near to where their part of the mesh begins first."""
        return np.argsort(self.flattening.distances()[self.texels.face], kind="stable")

    def map(self, values: np.ndarray) -> np.ndarray:
        """(side, side, ...) with the values (N, ...) at the texels, and zeros between charts."""
        side = self.texels.side
        image = np.zeros((side * side, *values.shape[1:]), values.dtype)
        image[self.texels.index] = values
        return image.reshape(side, side, *values.shape[1:])

    def angles(self) -> np.ndarray:
        """(N,) float32 from dP/du of their charts to the texture's right, counter-clockwise seen from outside
        [rad]."""
        face = self.texels.face
        right, _ = interpolate_frames(self.mesh, face, self.texels.barycentric, self.directions)
        t, b = np.moveaxis(face_frames(self.mesh)[face, :2], 1, 0)
        return np.arctan2(dot(right, b), dot(right, t)).astype(np.float32)
