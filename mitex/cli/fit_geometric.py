"""`mitex fit geometric`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from mitex.cli.fitting import Fitting


@dataclass(kw_only=True)
class FitGeometric(Fitting):
    """Learn the geometric texture of one mesh with a hierarchy of face-convolution GANs.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the model;
    `mitex apply RUN --mesh MESH --out ASSET` grows it on any mesh. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit geometric --reference spikes
      mitex fit geometric --reference cactus.obj --out runs/cactus
      mitex fit geometric --reference ring.obj --template coarse-ring.obj --preset paper
      mitex fit geometric --reference cactus.obj --out runs/cactus --resume --steps 12000   (one more level)
    """

    reference: Annotated[str, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or a reference by formula: spikes, scales, knobs, ridges,
    craters, warts."""

    out: Annotated[Path | None, arg(metavar="RUN", help_behavior_hint="(default: runs/REFERENCE)")] = None
    """Run folder."""

    preset: Annotated[str | None, arg(metavar="fast|paper", help_behavior_hint="(default: fast)")] = None
    """Settings to start from: `fast`, or `paper`, which follows the publication."""

    template: Annotated[str | None, arg(metavar="MESH", help_behavior_hint="(default: by genus)")] = None
    """Coarse mesh of the reference's topology from which its training meshes are made."""

    def run(self) -> None:
        shared = self.shared()
        from mitex.methods import geometric
        from mitex.methods.geometric.references import find_reference

        reference = find_reference(self.reference)
        out = self.out or Path("runs") / reference.name
        geometric.fit(reference, out, template=self.template, **shared)
        print(out)
