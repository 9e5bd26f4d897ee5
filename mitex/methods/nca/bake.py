"""The maps of a grown state: at the vertices of a mesh, and on the texels of its UV layout."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch

from mitex.asset import Asset
from mitex.atlas import Atlas
from mitex.exemplar import MAPS
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import orthonormal, unit
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.surface import Points, Surface, vertex_points
from mitex.methods.nca.look import Look
from mitex.methods.nca.orientation import Turn, rightwards
from mitex.methods.nca.palette import Palette
from mitex.progress import announce

CHUNK = 1 << 18  # points that are decoded at a time


class GrownTexture:
    """A state on an automaton's mesh, and what it shows at points of the mesh that the texture is for.

    Args:
        look: the decoder and the maps.
        state: (V, C).
        cells: the automaton's mesh.
        orientation: of the texture.
        palette: the exemplar's colours, which all albedos are held within; None for as they are.
        surface: of the automaton's mesh, if it has been built before.
    """

    def __init__(
        self,
        look: Look,
        state: torch.Tensor,
        cells: Cells,
        orientation: Turn = 0.0,
        palette: Palette | None = None,
        surface: Surface | None = None,
    ) -> None:
        self.look, self.cells, self.orientation, self.palette = look, cells, orientation, palette
        self.surface = surface or Surface(cells.mesh, look.interpolation)
        self.table = self.surface.table(state)

    @torch.no_grad()
    def values(self, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """Values (P, K) float32, clipped to [0, 1], at points of the base mesh; columns as `look.layout`."""
        parts = [np.empty((0, sum(MAPS[name] for name in self.look.maps)), np.float32)]
        for start in range(0, len(face), CHUNK):
            chunk = slice(start, start + CHUNK)
            arrays = self.cells.locate(face[chunk], barycentric[chunk])
            points = Points(*(torch.from_numpy(np.ascontiguousarray(a)) for a in arrays))
            parts.append(self._decoded(points))
        return np.concatenate(parts)

    def project(self, values: np.ndarray) -> np.ndarray:
        """Values (P, K) whose albedos are within the exemplar's colours, if these are known."""
        if self.palette is None:
            return values
        values, columns = values.copy(), list(self.look.layout["albedo"])
        values[:, columns] = self.palette.project(values[:, columns])
        return values

    def _decoded(self, points: Points) -> np.ndarray:
        """Values (P, K) at points of the automaton's mesh."""
        return self.project(self.look.decoder(self.surface, self.table, points).clamp_(0, 1).numpy())

    def at_vertices(self) -> dict[str, np.ndarray]:
        """Maps (V, c) at the vertices of the base mesh."""
        return self.maps(self.values(*self._vertices()))

    def asset(self) -> Asset:
        """The base mesh with the maps at its vertices."""
        mesh = self.cells.base
        right = self._right(mesh.normals, *self._vertices())
        return Asset(mesh, self.at_vertices(), right, name=mesh.name)

    def textures(self, atlas: Atlas) -> dict[str, np.ndarray]:
        """Maps (N, N, c) on the texels of a layout of the base mesh; the mean where there is no chart."""
        side, maps = atlas.resolution, self.look.maps
        images = {name: np.zeros((side, side, MAPS[name]), np.float32) for name in maps}
        for rows in atlas.strips():
            announce("baking the maps", rows.start, side)
            used, face, barycentric = atlas.points(rows)
            for name, values in self.maps(self.values(face, barycentric)).items():
                detail = self.object_normals(values, face, barycentric) if name == "normal" else values
                images[name][rows][used] = detail
        empty = atlas.face < 0
        for name, image in images.items():
            if name == "normal":
                images[name] = atlas.normal_map(self.cells.base, image)
            elif not empty.all():
                image[empty] = image[~empty].mean(axis=0)
        return images

    def maps(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """The columns (P, c) of values (P, K), by map."""
        return {name: values[:, list(columns)] for name, columns in self.look.layout.items()}

    def object_normals(self, encoded: np.ndarray, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """Normals in object space (P, 3) of a normal map's values at points of the base mesh."""
        mesh = self.cells.base
        normals = unit(interpolate(barycentric, mesh.shading_normals[face]))
        right = self._right(normals, face, barycentric)
        x, y, z = (encoded * 2 - 1).T[..., None]
        return x * right + y * np.cross(normals, right) + z * normals

    def detail_normals(
        self, maps: Mapping[str, np.ndarray], normals: np.ndarray, face: np.ndarray, barycentric: np.ndarray
    ) -> np.ndarray:
        """Unit normals in object space (P, 3) of what it shows at points of the base mesh.

        Args:
            maps: (P, c) by name, of these points.
            normals: (P, 3) unit, the mesh's own there.
            face, barycentric: (P,) and (P, 3), the points.
        """
        return unit(self.object_normals(maps["normal"], face, barycentric)) if "normal" in maps else normals

    def _vertices(self) -> tuple[np.ndarray, np.ndarray]:
        """A face (V,) and barycentrics (V, 3) of each vertex of the base mesh."""
        points = vertex_points(self.cells.base)
        return points.face.numpy(), points.barycentric.numpy()

    def _right(self, normals: np.ndarray, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """Where the exemplar's right points, (P, 3) unit, at points of the base mesh with these normals.

        Training views have +y up, so without a turn right is y x normal.
        """
        if not isinstance(self.orientation, np.ndarray):
            return rightwards(normals, self.orientation).astype(np.float32)
        mesh = self.cells.mesh
        right = rightwards(mesh.normals, self.orientation).astype(np.float32)
        located, weights = self.cells.locate(face, barycentric)
        return orthonormal(interpolate(weights, right[mesh.faces[located]]), normals).astype(np.float32)
