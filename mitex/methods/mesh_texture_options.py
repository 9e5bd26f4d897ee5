"""The options of `mitex apply` for textures that belong to the mesh they were made on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mitex.methods.options import OptionalMeshOptions

if TYPE_CHECKING:
    from mitex.methods.interface import Applied


@dataclass(kw_only=True)
class MeshTextureOptions(OptionalMeshOptions):
    """A mesh that is only checked; a method's own class has the help and the examples."""

    def applied(self, out: Path) -> Applied:
        from mitex.mesh import Mesh
        from mitex.methods.registry import load

        texture: Any = load(self.model)  # of a method that needs no mesh
        return texture.apply(None if self.mesh is None else Mesh.load(self.mesh))
