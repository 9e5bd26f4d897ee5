"""Synthesize a texture on one mesh, texel by texel, with all its maps; look at it from two sides; export it.

usage: python scenes/surface_synthesis.py [OUT.png]

Takes minutes; the run folder beside the picture keeps checkpoints and previews.
"""

import sys
from collections.abc import Sequence

import numpy as np

from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods import surface
from mitex.render import still, tone


def main(
    out: str = "octopus.png", run: str = "runs/octopus", settings: Sequence[str] = (), spp: int = 64
) -> None:
    mesh = embedded("octopus")
    asset = surface.fit("scales", mesh, run, set=settings).apply()
    print(asset.export(f"{run}/octopus.glb"))
    sides = [still(asset, resolution=512, spp=spp, azimuth=a) for a in (20, 200)]
    print(write_image(out, np.hstack([tone(side) for side in sides])))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "octopus.png")
