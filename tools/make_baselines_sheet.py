"""Draws a sheet of docs/gallery: one exemplar on one mesh, by methods and what they are compared with.

    python tools/make_baselines_sheet.py --exemplar lava --mesh vase --methods surface nca ... -- out/lava ...

The last arguments are folders that `mitex compare` wrote, from whose pictures the sheet is put together.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from make_comparison_sheet import GALLERY, rows_of

from mitex.comparison.look_pair import picture_of
from mitex.comparison.results import labels
from mitex.images import read_image, write_image
from mitex.render import sheet

CELL = 384  # side of a picture [px]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--exemplar", required=True)
    parser.add_argument("--mesh", required=True)
    parser.add_argument("--methods", nargs="+", required=True, help="in this order")
    parser.add_argument("--sheet", default="baselines", help="its name (baselines)")
    parser.add_argument("folders", nargs="+", type=Path)
    arguments = parser.parse_args()
    pair = arguments.exemplar, arguments.mesh
    rows = [row for folder in arguments.folders for row in rows_of(folder)]
    names = labels(row[key] for row in rows for key in ("exemplar", "mesh"))
    first = {
        row["method"]: row for row in reversed(rows) if (names[row["exemplar"]], names[row["mesh"]]) == pair
    }
    pictures = [picture_of(arguments.exemplar)]
    pictures += [read_image(Path(first[method]["picture"])) for method in arguments.methods]
    captions = ["exemplar", *arguments.methods]
    image = sheet(pictures, columns=min(len(pictures), 5), labels=captions, cell=CELL)
    path = write_image(GALLERY / f"{arguments.sheet}.jpg", image)
    print(path)


if __name__ == "__main__":
    main()
