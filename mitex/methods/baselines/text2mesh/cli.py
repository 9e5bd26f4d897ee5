"""The command-line options of Text2Mesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from mitex.methods.checks import mutually_exclusive
from mitex.methods.mesh_texture_options import MeshTextureOptions
from mitex.methods.option_types import PlainText
from mitex.methods.options import MeshFitOptions
from mitex.methods.words.options import ExemplarOrWordsOptions
from mitex.training.settings import RunSettings


@dataclass(kw_only=True)
class Fit(MeshFitOptions, ExemplarOrWordsOptions):
    """Learn a network that colours one mesh by the place, as Text2Mesh (Michel et al. 2022) does: until views
    of it look like an exemplar's albedo, or are what words say. Words also move its vertices.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit text2mesh --exemplar lava --mesh vase --out runs/field
      mitex fit text2mesh --exemplar lava --mesh bunny.obj --preset paper
      mitex fit text2mesh --text "red dots on white" --mesh vase --out runs/dots
      mitex fit text2mesh --exemplar lava --mesh vase --out runs/field --resume
    """

    text: Annotated[PlainText | None, arg(metavar="WORDS", help_behavior_hint="")] = None
    """In place of an exemplar: what the mesh is made of. It gets colours, and a shape."""

    def run(self) -> None:
        self.check_source()
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        print(self.fit(options))

    def check_source(self) -> None:
        super().check_source()
        mutually_exclusive("--text", "--exemplar", self.text is not None and self.exemplar is not None)

    def fit_exemplar(self, options: RunSettings) -> Path:
        from mitex.exemplar import Exemplar
        from mitex.mesh import Mesh
        from mitex.methods.baselines import text2mesh

        exemplar, mesh = Exemplar.load(str(self.exemplar)), Mesh.load(self.mesh)
        out = self.folder(f"{exemplar.name}-{mesh.name}-text2mesh")
        with self.progress() as on_step:
            text2mesh.fit(exemplar, mesh, out, keep_uvs=self.keep_uvs, on_step=on_step, **options)
        return out

    def fit_text(self, text: str, options: RunSettings) -> Path:
        from mitex.mesh import Mesh
        from mitex.methods.baselines import text2mesh

        mesh = Mesh.load(self.mesh)
        out = self.words_folder(text, mesh.name, "text2mesh")
        with self.progress() as on_step:
            text2mesh.fit_text(
                text, mesh, out, clip=self.clip, keep_uvs=self.keep_uvs, on_step=on_step, **options
            )
        return out


@dataclass(kw_only=True)
class Apply(MeshTextureOptions):
    """Write the texture on the mesh that it was learned on, which is kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/field --out vase.glb
    """
