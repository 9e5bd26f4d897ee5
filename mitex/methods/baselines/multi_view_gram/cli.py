"""The command-line options of textures that are optimized through views."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tyro.conf import arg

from mitex.methods.mesh_texture_options import MeshTextureFitOptions, MeshTextureOptions


@dataclass(kw_only=True)
class Fit(MeshTextureFitOptions):
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

    method: ClassVar[str] = "multi_view_gram"

    content: Annotated[Path | None, arg(metavar="IMAGE", help_behavior_hint="")] = None
    """Style transfer: keep the structure of this texture, on the mesh's own UVs."""

    def further(self) -> dict[str, object]:
        return {"content": self.content}


@dataclass(kw_only=True)
class Apply(MeshTextureOptions):
    """Write the texture on the mesh that it was optimized on, which is kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/views --out vase.glb
    """
