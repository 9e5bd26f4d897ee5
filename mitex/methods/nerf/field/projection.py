"""Coordinates around a base shape: the foot point and the signed distance of a point in space.

Section 3.1.2 of NeRF-Texture (Huang et al. 2023), and the derivative of section 3.1.3. The rays go both ways
along the coarse normal, so that points inside find the surface too and base shapes with holes work: a sign
comes from which way the surface was met, never from a test of what is inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from mitex.errors import ConfigError, MeshError
from mitex.mesh import Mesh
from mitex.methods.nerf.field.nearest import NearestVertices
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.scenes.shapes import mesh_shape

MISSED = 10.0  # the distance of points without a foot
BACK = 1e-5  # of the mesh's extent: rays start so far behind the point, which may lie on the surface
NEAREST = 1e-8  # vertices are taken to be at least so far away [mesh units]
CANCELLED = 1e-5  # a weighted mean of unit vectors shorter than that has no direction


@dataclass(frozen=True, eq=False)
class Projections:
    """Where N points project to.

    Attributes:
        point: (N, 3) float32 foot points on the mesh; the points themselves where missed.
        distance: (N,) float32 signed distances, positive outside; `MISSED` where missed [mesh units].
        normal: (N, 3) float32 unit coarse normals n_c, the directions of projection; zero where missed.
        face: (N,) int32 faces of the foot points, -1 where missed.
        barycentric: (N, 2) float32 weights of the faces' corners 1 and 2; zero where missed.
    """

    point: np.ndarray
    distance: np.ndarray
    normal: np.ndarray
    face: np.ndarray
    barycentric: np.ndarray

    @property
    def hit(self) -> np.ndarray:
        """(N,) bool, which points have a foot."""
        return self.face >= 0


class Projection:
    """Projects points onto a mesh along an interpolated normal.

    The normal is equation 1 as the authors' program has it: of the nearest vertices, weighted by one over
    their distances, and of the mean direction from them to the point at the pseudo-distance `repulsion`,
    turned around where it opposes the normals, that is, inside.

    Args:
        mesh: the base shape; holes and separate pieces are allowed.
        neighbours: vertices that the normal is interpolated from.
        repulsion: the smaller, the more the normal points away from the nearest vertices, so that it meets
            the mesh from afar (0.01 in the paper); None for the vertex normals alone [mesh units].
        reach: points whose foot would be farther than this are missed, the sooner the farther they are from
            the mesh; None for no limit [mesh units].

    Raises:
        ConfigError: a number is out of range.
        MeshError: the mesh has no faces.
    """

    def __init__(
        self, mesh: Mesh, *, neighbours: int = 8, repulsion: float | None = 0.05, reach: float | None = None
    ) -> None:
        if neighbours < 1:
            raise ConfigError(f"a normal of {neighbours} neighbours", "use 1 or more")
        if not all(value is None or value > 0.0 for value in (repulsion, reach)):
            raise ConfigError(
                f"a repulsion of {repulsion} and a reach of {reach}", "use positive numbers or None"
            )
        if not len(mesh.faces):
            raise MeshError(f"{mesh.name} has no faces to project onto", "give a surface")
        init(needs="ad")
        self.mesh, self.repulsion, self.reach = mesh, repulsion, reach
        # A point of a triangle with edges up to L is within L / sqrt(3) of a corner: the limit loses no foot.
        edges = _edge_lengths(mesh)
        limit = math.inf if reach is None else reach + float(edges.max()) / math.sqrt(3.0)
        used = np.unique(mesh.faces)
        self._count = min(neighbours, len(used))
        self._nearest = NearestVertices(mesh.vertices[used], self._count, float(edges.mean()), limit)
        self._vertices = upload(mi.Float, mesh.vertices[used].ravel())
        self._normals = upload(mi.Float, mesh.normals[used].ravel())
        self._back = BACK * float(np.ptp(mesh.vertices, axis=0).max())
        # Only these intersections are watertight: rays through a vertex would slip through otherwise.
        scene = {"type": "scene", "embree_use_robust_intersections": True, "mesh": mesh_shape(mesh)}
        self._scene = mi.load_dict(scene)

    def __call__(self, points: np.ndarray) -> Projections:
        """Projections of points (N, 3), finite [mesh units]."""
        points = np.ascontiguousarray(points, np.float32)
        near, index = self._nearest(points)
        if 0 < len(near) == len(points):
            return self._cast(points, index)
        projections = _missed(points)
        if len(near):
            subset = self._cast(points[near], index)
            for name, values in vars(projections).items():
                values[near] = getattr(subset, name)
        return projections

    def _cast(self, points: np.ndarray, index: np.ndarray) -> Projections:
        """Projections of points (M, 3) with their nearest vertices (M, K): one kernel, both ways."""
        with dr.suspend_grad():
            x = dr.unravel(mi.Point3f, upload(mi.Float, points.ravel()))
            normal = self._coarse_normal(x, upload(mi.UInt32, index.ravel()))
            ahead, behind = self._first(x, normal), self._first(x, -normal)
            is_inside = dr.abs(ahead[1]) < dr.abs(behind[1])
            hits, t = dr.select(is_inside, ahead[0], behind[0]), dr.select(is_inside, ahead[1], behind[1])
            hit, face, distance = hits.is_valid(), mi.Int32(hits.prim_index), dr.select(is_inside, -t, t)
            results = [
                x - mi.Point3f(dr.select(hit, distance, 0.0) * normal),
                dr.select(hit, distance, MISSED),
                dr.select(hit, normal, 0.0),
                dr.select(hit, face, -1),
                dr.select(hit, hits.prim_uv, 0.0),
            ]
            flat = [dr.ravel(result) for result in results]
            dr.eval(flat)
        arrays = [np.asarray(a) for a in flat]
        return Projections(
            arrays[0].reshape(-1, 3), arrays[1], arrays[2].reshape(-1, 3), arrays[3], arrays[4].reshape(-1, 2)
        )

    def _coarse_normal(self, x: mi.Point3f, index: mi.UInt32) -> mi.Vector3f:
        """Equation 1 at points x, given the flat indices of their nearest vertices."""
        first = dr.arange(mi.UInt32, dr.width(x)) * self._count
        total, away, weights = mi.Vector3f(0.0), mi.Vector3f(0.0), mi.Float(0.0)
        nearest = mi.Vector3f(0.0)
        for k in range(self._count):
            vertex = dr.gather(mi.UInt32, index, first + k)
            normal = dr.gather(mi.Vector3f, self._normals, vertex)
            offset = mi.Vector3f(x - dr.gather(mi.Point3f, self._vertices, vertex))
            weight = dr.rcp(dr.maximum(dr.norm(offset), NEAREST))
            total += weight * normal
            away += (weight * weight) * offset
            weights += weight
            nearest = normal if k == 0 else nearest
        if self.repulsion is not None:
            outwards = dr.mulsign(away / weights, dr.dot(away, total)) / dr.opaque(mi.Float, self.repulsion)
            total += outwards
        length = dr.norm(total)
        return dr.select(length > CANCELLED * weights, total / length, nearest)

    def _first(self, x: mi.Point3f, direction: mi.Vector3f) -> tuple[mi.PreliminaryIntersection3f, mi.Float]:
        """The first intersection from x, and how far along the direction it is; slightly behind counts."""
        back = dr.opaque(mi.Float, self._back)
        ray = mi.Ray3f(x - mi.Point3f(back * direction), direction)
        if self.reach is not None:
            ray.maxt = dr.opaque(mi.Float, self.reach + self._back)
        hit = self._scene.ray_intersect_preliminary(ray, coherent=False)
        return hit, hit.t - back


def attach(points: torch.Tensor, projections: Projections) -> tuple[torch.Tensor, torch.Tensor]:
    """Foot points and distances as tensors with the derivative of equation 2 to the points.

    Args:
        points: (N, 3) float32, attached.
        projections: theirs.

    Returns:
        Foot points (N, 3) with d x_c / d x = I - n n^T, and signed distances (N,) with d s / d x = n; no
        derivative where missed. The normal n is constant.
    """
    return _Attach.apply(points, projections)


class _Attach(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, points: torch.Tensor, projections: Projections
    ) -> tuple[torch.Tensor, torch.Tensor]:
        normal, hit = (torch.from_numpy(a).to(points.device) for a in (projections.normal, projections.hit))
        ctx.save_for_backward(normal, hit)
        foot, distance = (
            torch.from_numpy(a).to(points.device) for a in (projections.point, projections.distance)
        )
        return foot, distance

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor, None]:
        normal, hit = ctx.saved_tensors
        foot, distance = gradients
        along = distance - (normal * foot).sum(1)
        return foot * hit[:, None] + along[:, None] * normal, None


def _missed(points: np.ndarray) -> Projections:
    """Projections of points (N, 3), none of which has a foot."""
    count = len(points)
    return Projections(
        point=points.copy(),
        distance=np.full(count, MISSED, np.float32),
        normal=np.zeros((count, 3), np.float32),
        face=np.full(count, -1, np.int32),
        barycentric=np.zeros((count, 2), np.float32),
    )


def _edge_lengths(mesh: Mesh) -> np.ndarray:
    """(F, 3) lengths of the faces' edges."""
    corners = mesh.vertices[mesh.faces]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
