"""A mesh as a Mitsuba scene that is built once, and what its cameras see of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.plugins import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.scenes.cameras import Cameras
from mitex.scenes.shapes import mesh_shape
from mitex.sparse import csr


@dataclass(frozen=True, eq=False)
class Visibility:
    """Which surface point each pixel sees, as a sparse matrix from vertices to pixels in CSR form.

    Row `r` belongs to pixel `r` of the flat K x H x W order and holds three entries (the hit triangle's
    barycentric weights) per sample that hit, so a row adds up to the covered fraction of its pixel and is
    empty in the background.

    The barycentrics are those of the ray's hit point on the triangle, that is, perspective-correct. The
    authors' rasterizer interpolates affinely in the image; the two differ by the relative depth range of a
    triangle (under 1 % of a pixel's weights on the training sphere) and agree for orthographic cameras.

    Attributes:
        indptr: (K H W + 1,) int32, first entry of every row.
        indices: (3 P,) int32, vertex of every entry; P is the number of samples that hit.
        weights: (3 P,) float32, barycentric weight of every entry, divided by the samples per pixel.
        vertices: number of vertices V (columns).
        shape: (K, H, W).
        samples: samples per pixel.
    """

    indptr: torch.Tensor
    indices: torch.Tensor
    weights: torch.Tensor
    vertices: int
    shape: tuple[int, int, int]
    samples: int = 1

    @property
    def vertex_index(self) -> torch.Tensor:
        """(P, 3) int64: vertices of the triangle that each hitting sample sees."""
        return self.indices.view(-1, 3).long()

    @property
    def weight(self) -> torch.Tensor:
        """(P, 3) float32: barycentric weights over samples per pixel."""
        return self.weights.view(-1, 3)

    @property
    def pixel(self) -> torch.Tensor:
        """(P,) int64: flat index in K x H x W of each hitting sample, in ascending order."""
        hits = self.indptr.diff() // 3
        return torch.repeat_interleave(torch.arange(len(hits), device=hits.device), hits)

    @cached_property
    def coverage(self) -> torch.Tensor:
        """(K, H, W) float32: fraction of each pixel's samples that hit the mesh."""
        return (self.indptr.diff().float() / (3 * self.samples)).view(self.shape)

    @cached_property
    def matrix(self) -> torch.Tensor:
        """(K H W, V) float32 sparse CSR: multiplied with a field it gives the pixels."""
        return csr(self.indptr, self.indices, self.weights, (len(self.indptr) - 1, self.vertices))

    def to(self, device: torch.device | str) -> Visibility:
        """The same on another device."""
        moved = (t.to(device) for t in (self.indptr, self.indices, self.weights))
        return Visibility(*moved, vertices=self.vertices, shape=self.shape, samples=self.samples)


@dataclass(frozen=True, eq=False)
class Hits:
    """Where the samples of some cameras' pixels meet the surface.

    Attributes:
        hit: (K H W n n,) bool, which samples do, n x n for each pixel.
        face: (P,) int32, the triangle under each of those that do.
        barycentric: (P, 3) float32, where on it.
    """

    hit: torch.Tensor
    face: torch.Tensor
    barycentric: torch.Tensor


class Stage:
    """One mesh in one Mitsuba scene; everything that changes afterwards is an update of its parameters.

    Mitsuba keeps some memory of every `load_dict`, so a training builds its stage once and moves cameras,
    values and vertices, not scenes. `scene` is complete: the mesh has a diffuse BSDF whose reflectance is a
    `vertex_field` (parameter `mesh.bsdf.reflectance.data`), and its integrator is a `feature` that images it.

    Args:
        mesh: the mesh, in the space that cameras are given in.
        channels: C of the field, which is zero at first.
        background: value of pixels that see nothing, one number or C.

    Raises:
        ConfigError: if there is no channel, the background does not fit them, or the variant is scalar.
    """

    FIELD = "mesh.bsdf.reflectance.data"

    def __init__(self, mesh: Mesh, channels: int = 3, background: Sequence[float] | float = 0.0) -> None:
        init(needs="ad")
        if not dr.is_jit_v(mi.Float):
            raise ConfigError(f"the variant is '{mi.variant()}'", "set an llvm or cuda one, or none")
        if channels < 1:
            raise ConfigError(f"a field of {channels} channels", "use at least 1")
        self.mesh = mesh
        self.channels = channels
        self.background = background_values(background, channels)
        field = {"type": "vertex_field", "data": dr.zeros(mi.TensorXf, (len(mesh.vertices), channels))}
        self.scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {
                    "type": "feature",
                    "name": "reflectance",
                    "background": upload(mi.TensorXf, np.array([self.background], np.float32)),
                },
                "mesh": mesh_shape(mesh, {"type": "diffuse", "reflectance": field}),
            }
        )
        self._faces = torch.tensor(mesh.faces)

    def move(self, vertices: np.ndarray) -> None:
        """Gives the mesh other vertex positions, (V, 3), and keeps its faces.

        Raises:
            MeshError: if there is not one position per vertex, or one is not finite.
        """
        self.mesh = self.mesh.with_vertices(vertices)
        params = mi.traverse(self.scene)
        params["mesh.vertex_positions"] = upload(mi.Float, self.mesh.vertices.ravel())
        params.update()

    def visibility(self, cameras: Cameras, antialias: int = 1) -> Visibility:
        """Traces the pixels of all cameras at once and says which vertices each one sees.

        Args:
            cameras: K views of H x W pixels.
            antialias: n for n x n regularly spaced samples per pixel; 1 is one sample at the centre.

        Raises:
            ConfigError: if `antialias` is below 1.
        """
        hits = self.hits(cameras, antialias)
        samples = antialias * antialias
        weights = hits.barycentric.view(-1)
        if samples > 1:
            weights /= samples
        entries = 3 * hits.hit.view(-1, samples).sum(1, dtype=torch.int32)
        indptr = entries.new_zeros(len(entries) + 1)
        torch.cumsum(entries, 0, dtype=torch.int32, out=indptr[1:])
        return Visibility(
            indptr,
            self._faces.to(weights.device)[hits.face].view(-1),
            weights,
            vertices=len(self.mesh.vertices),
            shape=cameras.shape,
            samples=samples,
        )

    def hits(self, cameras: Cameras, antialias: int = 1) -> Hits:
        """Where the pixels of all cameras meet the surface; arguments and errors as in `visibility`."""
        if antialias < 1:
            raise ConfigError(f"antialias {antialias}", "use 1 for one sample per pixel, or n for n x n")
        hit, face, u, v = self._trace(cameras, antialias)
        if not bool(hit.all()):
            index = hit.nonzero().view(-1)
            face, u, v = face[index], u[index], v[index]
        return Hits(hit, face, torch.stack((1 - u - v, u, v), dim=1))

    def _trace(self, cameras: Cameras, n: int) -> tuple[torch.Tensor, ...]:
        """Hit (bool), triangle (int32), barycentrics u and v of every sample, (K H W n n,) each."""
        with dr.suspend_grad():
            ray = _rays(cameras, n)
            hits = self.scene.ray_intersect_preliminary(ray, coherent=True)
            hit, triangle, uv = hits.is_valid(), hits.prim_index, hits.prim_uv
            dr.eval(hit, triangle, uv)
            u, v = mi.Float(uv.x), mi.Float(uv.y)
        hit, triangle, u, v = (_tensor(array) for array in (hit, triangle, u, v))
        return hit, triangle.view(torch.int32), u, v


def _tensor(array: dr.ArrayBase) -> torch.Tensor:
    return cast(torch.Tensor, array.torch())


def _rays(cameras: Cameras, n: int) -> mi.Ray3f:
    """The cameras' rays with n x n samples per pixel, as one wavefront ordered by pixel."""
    count, height, width = cameras.shape
    index = dr.arange(mi.UInt32, count * height * width * n * n)
    # Opaque sizes keep one kernel for all resolutions.
    side, columns, rows = (dr.opaque(mi.UInt32, size) for size in (n, width, height))
    sample, index = index % (side * side), index // (side * side)
    column, index = index % columns, index // columns
    row, camera = index % rows, index // rows
    x = (mi.Float(column) + (mi.Float(sample % side) + 0.5) / mi.Float(side)) * (2 / mi.Float(columns)) - 1
    y = 1 - (mi.Float(row) + (mi.Float(sample // side) + 0.5) / mi.Float(side)) * (2 / mi.Float(rows))

    def affine(terms: np.ndarray) -> mi.Vector3f:
        flat = upload(mi.Float, np.ascontiguousarray(terms).ravel())
        constant, along_x, along_y = (dr.gather(mi.Vector3f, flat, 3 * camera + term) for term in range(3))
        return constant + x * along_x + y * along_y

    origins, directions = cameras.basis()
    return mi.Ray3f(mi.Point3f(affine(origins)), dr.normalize(affine(directions)))


def background_values(background: Sequence[float] | float, channels: int) -> list[float]:
    """One background value per channel from a number or a sequence.

    Raises:
        ConfigError: if a sequence has another length than the field has channels, or a value is not finite.
    """
    if isinstance(background, Sequence):
        values = [float(b) for b in background]
    else:
        values = [float(background)] * channels
    if len(values) != channels or not np.isfinite(values).all():
        raise ConfigError(
            f"background {background} does not fit a field of {channels} channels",
            f"give one finite number, or {channels} of them",
        )
    return values
