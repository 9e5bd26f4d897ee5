"""Synthesize a texture on one mesh, texel by texel; look at it from two sides; export it.

usage: python scenes/surface_synthesis.py [OUT.png] [--large]

Takes half a minute on two cores. --large: finer texels and all five maps, a few minutes.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods import surface
from mitex.render import still, tone
from mitex.training.progress import ProgressDisplay

QUICK = ("resolution=320", "exemplar_size=160", "steps=100", "milestones=75,90")


def main(
    out: str = "octopus.png",
    large: bool = False,
    settings: Sequence[str] = (),
    resolution: int = 512,
    spp: int = 32,
) -> None:
    exemplar = Exemplar.load("scales")
    if not large:
        exemplar, settings = Exemplar({"albedo": exemplar.maps["albedo"]}, "scales"), [*QUICK, *settings]
    with ProgressDisplay() as on_step:
        asset = surface.fit(exemplar, embedded("octopus"), set=settings, on_step=on_step).apply()
    print(asset.export(Path(out).with_suffix(".glb")))
    sides = [still(asset, resolution=resolution, spp=spp, azimuth=azimuth) for azimuth in (20, 200)]
    print(write_image(out, np.hstack([tone(side) for side in sides])))


if __name__ == "__main__":
    names = [word for word in sys.argv[1:] if word != "--large"]
    main(*names[:1], large="--large" in sys.argv)
