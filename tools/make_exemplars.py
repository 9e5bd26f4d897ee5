"""Makes the exemplars that ship with Mitex: procedural, tileable PBR sets, deterministic, ours (CC0).

    python tools/make_exemplars.py [--out DIR] [--sheet SHEET.png] [NAME ...]

Every material is one function that returns height and colours on a periodic grid of `FINE` x `FINE` samples;
normals and ambient occlusion follow from the height, and everything is averaged down to `SIZE` x `SIZE`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from exemplar_kit import SIZE, Material, lit, maps
from exemplars.coverings import leather, rust
from exemplars.fibres import knit, wicker
from exemplars.stone import cobblestone, lava
from exemplars.tiles import bricks, hexagons, scales
from exemplars.wood import planks
from PIL import Image

OUT = Path(__file__).parent.parent / "mitex" / "data" / "exemplars"
LICENSE = """CC0 1.0 Universal (public domain dedication)
https://creativecommons.org/publicdomain/zero/1.0/

The exemplars in this folder are procedural. They were made for Mitex by tools/make_exemplars.py; to the
extent possible under law, the Mitex authors have waived all copyright and related rights to them.
"""


MATERIALS: dict[str, tuple[Callable[[np.random.Generator], Material], int]] = {
    "bricks": (bricks, 15),
    "cobblestone": (cobblestone, 11),
    "hexagons": (hexagons, 16),
    "knit": (knit, 17),
    "lava": (lava, 12),
    "leather": (leather, 18),
    "planks": (planks, 19),
    "rust": (rust, 20),
    "scales": (scales, 13),
    "wicker": (wicker, 14),
}


def make(name: str) -> dict[str, np.ndarray]:
    """The maps of one exemplar, name -> (SIZE, SIZE, 1 or 3) uint8."""
    function, seed = MATERIALS[name]
    return maps(function(np.random.default_rng(seed)))


def main() -> None:
    parser = argparse.ArgumentParser(description="Makes the exemplars that ship with Mitex.")
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(MATERIALS)}; all when none is given"
    )
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument(
        "--sheet", type=Path, help="also write all maps and a lit preview side by side, for judging"
    )
    options = parser.parse_args()
    rows = []
    for name in options.names or MATERIALS:
        result = make(name)
        (options.out / name).mkdir(parents=True, exist_ok=True)
        for key, array in result.items():
            Image.fromarray(array.squeeze()).save(options.out / name / f"{key}.png", optimize=True)
        tiles = [np.broadcast_to(a, (SIZE, SIZE, 3)) for a in result.values()]
        columns = [np.concatenate([np.concatenate([t, t], 0) for t in tiles], 1), lit(result)]
        rows.append(np.concatenate(columns, 1))
    (options.out / "LICENSE").write_text(LICENSE)
    if options.sheet:
        Image.fromarray(np.concatenate(rows, 0)).save(options.sheet)


if __name__ == "__main__":
    main()
