"""The command-line options of Text2Mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from tyro.conf import arg

from mitex.methods.mesh_texture_options import MeshTextureOptions
from mitex.methods.options import ExemplarOptions


@dataclass(kw_only=True)
class Fit(ExemplarOptions):
    """Learn a network that colours one mesh by the place until views of it look like an exemplar's albedo, as
    Text2Mesh (Michel et al. 2022) does; the target is an image, not a text.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit text2mesh --exemplar lava --mesh vase --out runs/field
      mitex fit text2mesh --exemplar lava --mesh bunny.obj --preset paper
      mitex fit text2mesh --exemplar lava --mesh vase --out runs/field --resume
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
        from mitex.methods.baselines import text2mesh

        exemplar, mesh = Exemplar.load(self.exemplar), Mesh.load(self.mesh)
        out = self.folder(f"{exemplar.name}-{mesh.name}-text2mesh")
        with self.progress() as on_step:
            text2mesh.fit(exemplar, mesh, out, keep_uvs=self.keep_uvs, on_step=on_step, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(MeshTextureOptions):
    """Write the texture on the mesh that it was learned on, which is kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/field --out vase.glb
    """
