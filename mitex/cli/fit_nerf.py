"""`mitex fit nerf`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from mitex.cli.fitting import Fitting
from mitex.runtime import let_idle_threads_sleep


@dataclass(kw_only=True)
class FitNerf(Fitting):
    """Capture a texture with its meso-structure from photos (NeRF-Texture).

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --mesh MESH --out ASSET` puts it on any mesh. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit nerf --capture durian/
      mitex fit nerf --capture durian/ --base-mesh ellipsoid.obj --out runs/durian
      mitex fit nerf --capture durian/ --out runs/durian --resume
    """

    capture: Annotated[Path, arg(metavar="DIR")]
    """Folder with transforms.json and photos with masks (alpha), or with plain photos."""

    out: Annotated[Path | None, arg(metavar="RUN", help_behavior_hint="(default: runs/CAPTURE)")] = None
    """Run folder."""

    preset: Annotated[str | None, arg(metavar="fast|paper", help_behavior_hint="(default: fast)")] = None
    """Settings to start from: `fast`, or `paper`, which follows the publication."""

    base_mesh: Annotated[str | None, arg(metavar="MESH", help_behavior_hint="(default: found)")] = None
    """The shape without its texture, in the cameras' world."""

    def run(self) -> None:
        shared = self.shared()
        let_idle_threads_sleep()
        from mitex.methods import nerf

        capture = nerf.load_capture(self.capture)
        out = self.out or Path("runs") / capture.name
        nerf.fit(capture, out, base_mesh=self.base_mesh, **shared)
        print(out)
