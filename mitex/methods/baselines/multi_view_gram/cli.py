"""The command-line options of textures that are optimized through views."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tyro.conf import arg

from mitex.methods.mesh_texture_options import MeshTextureOptions
from mitex.methods.options import ExemplarOptions


@dataclass(kw_only=True)
class Fit(ExemplarOptions):
    """Optimize the texture of one mesh until random views of it look like an exemplar's albedo, as
    Mordvintsev et al. (2018) do.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit multi_view_gram --exemplar lava --mesh vase --out runs/views
      mitex fit multi_view_gram --exemplar lava --mesh bunny.obj --preset paper
      mitex fit multi_view_gram --exemplar painting.png --mesh bunny.obj --content bunny.png
      mitex fit multi_view_gram --exemplar lava --mesh vase --out runs/views --resume
    """

    fits_to_mesh: ClassVar[bool] = True

    mesh: Annotated[str, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh."""

    content: Annotated[Path | None, arg(metavar="IMAGE", help_behavior_hint="")] = None
    """Style transfer: keep the structure of this texture, on the mesh's own UVs."""

    keep_uvs: Annotated[bool, arg(help_behavior_hint="")] = False
    """Use the mesh's own UVs, which must not overlap."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.exemplar import Exemplar
        from mitex.mesh import Mesh
        from mitex.methods.baselines import multi_view_gram

        exemplar, mesh = Exemplar.load(self.exemplar), Mesh.load(self.mesh)
        out = self.folder(f"{exemplar.name}-{mesh.name}-multi_view_gram")
        with self.progress() as on_step:
            multi_view_gram.fit(
                exemplar,
                mesh,
                out,
                keep_uvs=self.keep_uvs,
                content=self.content,
                on_step=on_step,
                **options,
            )
        print(out)


@dataclass(kw_only=True)
class Apply(MeshTextureOptions):
    """Write the texture on the mesh that it was optimized on, which is kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/views --out vase.glb
    """
