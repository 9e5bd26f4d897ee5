"""The options of methods whose textures belong to the mesh that they were made on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from mitex.lazy import load
from mitex.methods.options import ExemplarOptions, MeshFitOptions, OptionalMeshOptions

if TYPE_CHECKING:
    from mitex.methods.interface import Applied


@dataclass(kw_only=True)
class MeshTextureFitOptions(MeshFitOptions, ExemplarOptions):
    """A fit of an exemplar on one mesh; a method's own class has the help and the examples.

    Attributes:
        method: the baseline that fits.
    """

    method: ClassVar[str]

    def further(self) -> dict[str, object]:
        """What a method's `fit` takes beside that."""
        return {}

    def run(self) -> None:
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.exemplar import Exemplar
        from mitex.mesh import Mesh

        exemplar, mesh = Exemplar.load(self.exemplar), Mesh.load(self.mesh)
        out = self.folder(f"{exemplar.name}-{mesh.name}-{self.method}")
        fit = load(f"mitex.methods.baselines.{self.method}:fit")
        with self.progress() as on_step:
            fit(exemplar, mesh, out, keep_uvs=self.keep_uvs, on_step=on_step, **self.further(), **options)
        print(out)


@dataclass(kw_only=True)
class MeshTextureOptions(OptionalMeshOptions):
    """A mesh that is only checked; a method's own class has the help and the examples."""

    def applied(self, out: Path) -> Applied:
        from mitex.mesh import Mesh
        from mitex.methods.registry import load

        texture: Any = load(self.model)  # of a method that needs no mesh
        return texture.apply(None if self.mesh is None else Mesh.load(self.mesh))
