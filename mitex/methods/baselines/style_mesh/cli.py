"""The command-line options of StyleMesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from tyro.conf import arg

from mitex.methods.mesh_texture_options import MeshTextureOptions
from mitex.methods.options import ExemplarOptions


@dataclass(kw_only=True)
class Fit(ExemplarOptions):
    """Optimize the texture of one mesh until views of it look like an exemplar's albedo, whose details are as
    large near the camera as far from it, as StyleMesh (Hoellein et al. 2022) does.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit style_mesh --exemplar lava --mesh vase --out runs/style
      mitex fit style_mesh --exemplar lava --mesh bunny.obj --set by_depth=false
      mitex fit style_mesh --exemplar lava --mesh vase --out runs/style --resume
    """

    fits_to_mesh: ClassVar[bool] = True

    mesh: Annotated[str, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh."""

    keep_uvs: Annotated[bool, arg(help_behavior_hint="")] = False
    """Use the mesh's own UVs, which must not overlap."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.exemplar import Exemplar
        from mitex.mesh import Mesh
        from mitex.methods.baselines import style_mesh

        exemplar, mesh = Exemplar.load(self.exemplar), Mesh.load(self.mesh)
        out = self.folder(f"{exemplar.name}-{mesh.name}-style_mesh")
        with self.progress() as on_step:
            style_mesh.fit(exemplar, mesh, out, keep_uvs=self.keep_uvs, on_step=on_step, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(MeshTextureOptions):
    """Write the texture on the mesh that it was optimized on, which is kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/style --out vase.glb
    """
