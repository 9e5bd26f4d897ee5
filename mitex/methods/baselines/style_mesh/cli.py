"""The command-line options of StyleMesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mitex.methods.mesh_texture_options import MeshTextureFitOptions, MeshTextureOptions


@dataclass(kw_only=True)
class Fit(MeshTextureFitOptions):
    """Optimize the texture of one mesh until views of it look like an exemplar's albedo, whose details are as
    large near the camera as far from it, as StyleMesh (Hoellein et al. 2022) does.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit style_mesh --exemplar lava --mesh vase --out runs/style
      mitex fit style_mesh --exemplar lava --mesh bunny.obj --set by_depth=false
      mitex fit style_mesh --exemplar lava --mesh vase --out runs/style --resume
    """

    method: ClassVar[str] = "style_mesh"


@dataclass(kw_only=True)
class Apply(MeshTextureOptions):
    """Write the texture on the mesh that it was optimized on, which is kept with it.

    --mesh only checks that a mesh is that one.

    examples:
      mitex apply runs/style --out vase.glb
    """
