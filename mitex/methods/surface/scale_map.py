"""The size of the pattern where it varies over a mesh: a painted picture, or a number for each vertex."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.images import bilinear, read_image
from mitex.mesh import Mesh
from mitex.mesh.vertex_files import read_array
from mitex.paths import expanded

SMALLEST, LARGEST = 0.25, 4.0  # factors of the pattern's size


@dataclass(frozen=True, eq=False)
class ScaleMap:
    """Factors of the pattern's size on a mesh.

    Attributes:
        values: (V,) at the vertices, or (H, W, 1) a picture.
        uv: (F, 3, 2) what the picture lies on, v upwards; None for numbers at the vertices.
    """

    values: np.ndarray
    uv: np.ndarray | None = None

    @staticmethod
    def of(source: np.ndarray | str | Path, mesh: Mesh) -> ScaleMap:
        """Reads a scale map for a mesh.

        Args:
            source: (V,) a factor for each vertex, or a .npy file of them; or a picture over the mesh's own
                UVs, whose grey is the factor: white 1, middle grey 0.5. Beyond [0, 1] it repeats.
            mesh: V vertices.

        Raises:
            ConfigError: not one finite number from 0.25 to 4 for each vertex of a face, or a picture for a
                mesh without UVs.
            ImageError: the picture cannot be read.
        """
        if isinstance(source, str | Path):
            place = expanded(source)
            if place.suffix.lower() != ".npy":
                picture = read_image(place, "L")
                if mesh.uv is None:
                    raise ConfigError(
                        f"mesh '{mesh.name}' has no UVs for the scale map '{place}'",
                        "give a mesh with UVs, or a .npy file with a number for each vertex",
                    )
                return ScaleMap(picture, mesh.uv)
            source = read_array(place, "a scale map")
        shape = (len(mesh.vertices),)
        if source.dtype.kind not in "fiu" or source.shape != shape:
            raise ConfigError(
                f"the scale map is {source.dtype} {source.shape}",
                f"give numbers of shape {shape}, one for each vertex of '{mesh.name}'",
            )
        if not np.isfinite(source).all():
            raise ConfigError("the scale map has numbers that are NaN or infinite", "give finite ones")
        values = np.array(source, np.float64)
        _check_range(values[mesh.faces], mesh.name)
        return ScaleMap(values)

    def at(self, mesh: Mesh, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """The factors (M,) float64 at points of the mesh that the map was read for.

        Args:
            mesh: with its faces.
            face: (M,) where the points lie.
            barycentric: (M, 3) where on the faces.

        Raises:
            ConfigError: one of them, of a picture, is not from 0.25 to 4.
        """
        if self.uv is None:
            factors = interpolate(barycentric, self.values[mesh.faces[face]][..., None])[:, 0]
        else:
            uv = interpolate(barycentric, self.uv[face].astype(np.float64))
            uv = np.where((uv < 0) | (uv > 1), uv % 1, uv)
            factors = bilinear(self.values, uv)[:, 0].astype(np.float32)
        _check_range(factors, mesh.name)
        return factors.astype(np.float64)


def _check_range(factors: np.ndarray, name: str) -> None:
    if factors.min() < SMALLEST - 1e-6 or factors.max() > LARGEST + 1e-6:
        raise ConfigError(
            f"the scale map goes from {factors.min():.3g} to {factors.max():.3g} on '{name}'",
            f"use factors from {SMALLEST:g} to {LARGEST:g} (in a picture: greys of 64 to 255)",
        )
