"""How well textures heal in the living page: wiped places grow again, and are compared with the exemplar.

usage: python -m benchmarks.living_page.healing [--quick]

Grows each texture on a sphere, wipes a place that is in view, lets it heal, and looks at the page's own
pictures of colours. The figure is the idea of SIFID, the Frechet distance of the features of one picture from
those of another, with VGG-16 in the place of Inception (`mitex.evaluation.metrics.single_image_frechet`), at
the pixels that were wiped.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mitex.evaluation.metrics import single_image_frechet
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture, living_page
from tests.browser import Browser, Tab

LOOKS = ("leather", "hexagons", "wicker", "rust", "bricks", "cobblestone")
SIDE = 256  # of the pictures [px]
SHARE = 0.6  # radius of the wiped place [radii of the sphere]


def figures(tab: Tab, name: str, steps: int) -> list[float]:
    """Distances from the exemplar before the place is wiped, then, and when it has healed."""
    tab.run("page.setMode('albedo'); await page.step(argument)", steps)
    before = tab.picture()
    place = f"page.pick({SIDE // 2}, {SIDE // 2}), {SHARE} * page.studio.radius * page.surface.scale"
    tab.run(f"page.erase({place})")
    wiped = tab.picture()
    tab.run("await page.step(argument)", steps)
    hurt = np.abs(wiped - before).max(2) > 0.02
    exemplar = Exemplar.load(name).maps["albedo"]
    return [
        single_image_frechet(exemplar, picture, mask_b=hurt) for picture in (before, wiped, tab.picture())
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "--quick", action="store_true", help="a small mesh and one texture: shows that it runs"
    )
    quick = parser.parse_args().quick
    looks, frequency, steps = (LOOKS[:1], 8, 40) if quick else (LOOKS, 24, 200)
    table = Table("texture", "before", "wiped", "healed", "healed / before")
    browser = Browser()
    with tempfile.TemporaryDirectory() as folder:
        for name in looks:
            path = Path(folder, f"{name}.html")
            living_page(NcaTexture.load(name), icosphere(frequency), path, steps=1, subdivide=0)
            before, wiped, healed = figures(browser.open(path, SIDE, steps="auto"), name, steps)
            table.add_row(name, f"{before:.1f}", f"{wiped:.1f}", f"{healed:.1f}", f"{healed / before:.2f}")
            print(name, before, wiped, healed, flush=True)
    browser.close()
    Console().print(table)


if __name__ == "__main__":
    main()
