"""The command-line options of X-Mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import arg

from mitex.methods.mesh_texture_options import MeshTextureOptions
from mitex.methods.option_types import PlainText
from mitex.methods.options import MeshFitOptions
from mitex.methods.words.options import WordsOptions


@dataclass(kw_only=True)
class Fit(MeshFitOptions, WordsOptions):
    """Learn a network that colours one mesh by the place and moves its vertices until views of it are what
    words say, through gates that the words set, as X-Mesh (Ma et al. 2023) does.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit x_mesh --text "red dots on white" --mesh vase --out runs/dots
      mitex fit x_mesh --text "colorful crochet" --mesh bunny.obj --clip models/clip-b32 --preset text-paper
      mitex fit x_mesh --text "red dots on white" --mesh vase --out runs/dots --resume
    """

    text: Annotated[PlainText, arg(metavar="WORDS")]
    """What the mesh is made of. It gets colours, and a shape."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.mesh import Mesh
        from mitex.methods.baselines import x_mesh

        mesh = Mesh.load(self.mesh)
        out = self.words_folder(self.text, mesh.name, "x-mesh")
        with self.progress() as on_step:
            x_mesh.fit(
                self.text, mesh, out, clip=self.clip, keep_uvs=self.keep_uvs, on_step=on_step, **options
            )
        print(out)


@dataclass(kw_only=True)
class Apply(MeshTextureOptions):
    """Write the texture on the mesh that it was learned on, as it was moved; both are kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/dots --out vase.glb
    """
