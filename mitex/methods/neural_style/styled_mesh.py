"""`StyledMesh`: a texture together with the shape that was learned with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from mitex.mesh import Mesh
from mitex.mesh.arrays import mesh_arrays, mesh_of_arrays
from mitex.methods.mesh_texture import MeshTexture

PREFIX = "shape_"  # of the arrays of the shape in a model file


@dataclass(frozen=True, eq=False)
class StyledMesh(MeshTexture):
    """A texture and its mesh, whose vertices may have been moved.

    Attributes:
        shape: the mesh as it was learned, perhaps with finer faces; None if it stayed as it was.
    """

    shape: Mesh | None = None

    @property
    def surface(self) -> Mesh:
        return self.shape or self.mesh

    @classmethod
    def _of(cls, arrays: Mapping[str, np.ndarray], about: Mapping[str, Any]) -> Self:
        plain = super()._of(arrays, about)
        own = {key.removeprefix(PREFIX): array for key, array in arrays.items() if key.startswith(PREFIX)}
        shape = mesh_of_arrays(own, plain.mesh.name) if own else None
        if shape is not None and shape.uv is None:
            raise ValueError("a shape without UVs")
        return cls(plain.mesh, plain.image, about, shape)

    def _arrays(self) -> dict[str, np.ndarray]:
        shape = {} if self.shape is None else mesh_arrays(self.shape)
        return super()._arrays() | {PREFIX + name: array for name, array in shape.items()}
