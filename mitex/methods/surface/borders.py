"""Texels at the border of a chart: their centres lie outside, so they show what lies across the seam.

A texel counts as used when any of its square overlaps a face, as bilinear lookups read it then. The paper
gives those whose centres lie outside a life of their own, at the nearest point of the surface; then both
sides of a seam hold values for the same places, which may differ. Here the texture is continued over the seam
along geodesics: such a texel is a mixture of the texels that lie where its centre unfolds to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from mitex.geometry.raster import texel_space
from mitex.geometry.triangles import barycentric_gradients, interpolate, twice_area
from mitex.mesh import Mesh
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.texels import Texels

ROUNDS = 24  # of following border texels that read each other
FAINT = 1e-3  # smaller shares are left out
LEAST = 0.05  # the share that must come from texels inside; else a border texel keeps a value of its own
FARTHEST = 2.0  # [texels] a stretched face does not carry a centre farther


@dataclass(frozen=True, eq=False)
class Border:
    """Which texels have values of their own, and what the others are.

    Attributes:
        elements: (n,) int64, the texels with values of their own, ascending.
        spread: (N, n) CSR float32, which gives the values of all N texels from these; rows sum to 1.
    """

    elements: np.ndarray
    spread: csr_array

    @staticmethod
    def none(count: int) -> Border:
        """All N texels have their own values (the paper)."""
        own = np.arange(count)
        return Border(own, csr_array((np.ones(count, np.float32), own, np.arange(count + 1))))

    @staticmethod
    def continued(mesh: Mesh, texels: Texels, tracer: GeodesicTracer) -> Border:
        """The texture goes on over seams.

        Where there is no other side, a border texel is read from inside its own chart; one without any other
        texel to read keeps a value of its own.

        Args:
            mesh: the surface.
            texels: of it, N.
            tracer: of the mesh.
        """
        count, inside = len(texels.index), np.flatnonzero(texels.inside)
        outside = np.flatnonzero(~texels.inside)
        if not len(inside) or not len(outside):
            return Border.none(count)
        shares = _resolved(_reads(mesh, texels, tracer, outside), inside, outside)
        total = np.asarray(shares.sum(axis=1))
        continued = total > LEAST
        elements = np.sort(np.concatenate([inside, outside[~continued]]))
        number = np.empty(count, np.int64)
        number[elements] = np.arange(len(elements))
        shares = shares.tocoo()
        row, column = shares.coords
        used = continued[row]
        row, column, data = row[used], column[used], shares.data[used]
        rows = np.concatenate([elements, outside[row]])
        columns = np.concatenate([number[elements], number[inside[column]]])
        values = np.concatenate([np.ones(len(elements)), data / total[row]]).astype(np.float32)
        return Border(elements, csr_array((values, (rows, columns)), shape=(count, len(elements))))


def _reads(mesh: Mesh, texels: Texels, tracer: GeodesicTracer, outside: np.ndarray) -> csr_array:
    """(G, N) bilinear weights of the texels around the points that the G centres `outside` unfold to."""
    face, barycentric = texels.face[outside], texels.barycentric[outside]
    corners = texel_space(texels.uv[face], texels.resolution)
    row, column = np.divmod(texels.index[outside], texels.resolution)
    away = np.stack([column, row], 1) - interpolate(barycentric, corners)
    slopes = barycentric_gradients(corners, twice_area(corners))[1]
    rates = np.stack([(slopes[:, :2] * away).sum(1), (slopes[:, 2:] * away).sum(1)], 1)
    points = mesh.vertices[mesh.faces[face]].astype(np.float64)
    direction = interpolate(rates, points[:, 1:] - points[:, :1])
    length = np.minimum(np.linalg.norm(direction, axis=1), FARTHEST * texels.size)
    end = tracer.trace(face, barycentric, direction, length)
    index, weight = texels.bilinear(end.face, end.barycentric)
    weight = np.where(index == outside[:, None], 0.0, weight)  # not itself
    total = weight.sum(1, keepdims=True)
    weight = weight / np.where(total > 0, total, 1.0)
    ends = 4 * np.arange(len(outside) + 1)
    return csr_array((weight.ravel(), index.ravel(), ends), shape=(len(outside), len(texels.index)))


def _resolved(reads: csr_array, inside: np.ndarray, outside: np.ndarray) -> csr_array:
    """(G, I) shares of the I texels `inside` in those `outside`; readings of others outside are traced on."""
    columns = reads.tocsc()
    direct, through = columns[:, inside].tocsr(), columns[:, outside].tocsr()
    shares = direct
    for _ in range(ROUNDS):
        shares = direct + through @ shares
    shares.data[shares.data < FAINT] = 0.0
    shares.eliminate_zeros()
    return shares
