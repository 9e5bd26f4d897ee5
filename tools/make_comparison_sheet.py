"""Puts comparisons together: tables of all of them, and a sheet in docs/gallery.

    python tools/make_comparison_sheet.py --mesh vase --methods surface nca -- out/lava out/bricks ...

The arguments are folders that `mitex compare` wrote, each with other exemplars. Prints two Markdown tables,
of likeness and of costs: the means over all pairs, those of each exemplar, and those of each mesh, with the
standard deviation over seeds where there are several. Where values lie on both sides of the best one, the
mean of their distances from it stands in brackets: in their own mean, opposite errors cancel. The sheet has a
row for each exemplar: itself, and a mesh by each method; with several meshes, the rows take them in turn.
With `--pairs`, the likeness of each single pair goes to docs/results/comparison-pairs.csv, in place of what
the file had of that pair, method and seed.
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from collections.abc import Iterable, Sequence
from itertools import cycle
from pathlib import Path

import numpy as np

from mitex.comparison.html import DASH, number_text
from mitex.comparison.look_pair import picture_of
from mitex.comparison.measures import COSTS, LOOKS, Measure
from mitex.comparison.results import labels
from mitex.comparison.summary import mean_and_spread
from mitex.images import read_image, write_image
from mitex.render import sheet

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
PAIRS = Path(__file__).parents[1] / "docs" / "results" / "comparison-pairs.csv"
IDENTITY = ("exemplar", "mesh", "method", "seed")
CELL = 240  # side of a picture [px]
Row = dict[str, str]


def rows_of(folder: Path) -> list[Row]:
    """What a comparison's report.csv holds, with the picture of each result."""
    with (folder / "report.csv").open(encoding="utf-8", newline="") as file:
        return [row | {"picture": str(_picture(folder, row["asset"]))} for row in csv.DictReader(file)]


def _picture(folder: Path, asset: str) -> Path:
    return folder / "measured" / f"{Path(asset).parent.name}.jpg"


def number(rows: Sequence[Row], measure: Measure) -> str:
    """The mean over pairs, and the standard deviation over seeds; a dash where nothing was measured.

    With the mean distance from the best value in brackets, where values lie on both sides of it.
    """
    by_seed: dict[str, list[float]] = defaultdict(list)
    for row in rows:
        if row[measure.key]:
            by_seed[row["seed"]].append(float(row[measure.key]))
    if not by_seed:
        return DASH
    values = list(by_seed.values())
    text = _with_spread(*mean_and_spread(values), measure.scale)
    if not (measure.two_sided and measure.distance):
        return text
    distances = [[measure.distance(value) for value in one] for one in values]
    return f"{text} ({_with_spread(*mean_and_spread(distances), measure.scale)})"


def _with_spread(mean: float, spread: float, scale: float) -> str:
    return number_text(scale * mean) + (f" ± {number_text(scale * spread, 2)}" if spread > 0 else "")


def _heading(measure: Measure) -> str:
    return f"{measure.label} (mean distance from the best)" if measure.two_sided else measure.label


def table(
    groups: Iterable[tuple[str, Sequence[Row]]], methods: Sequence[str], measures: Sequence[Measure]
) -> str:
    """Markdown: a line for each group and method."""
    names = ["exemplar or mesh", "method", *map(_heading, measures)]
    lines = [f"| {' | '.join(names)} |", "| --- " * len(names) + "|"]
    for name, group in groups:
        for method in methods:
            own = [row for row in group if row["method"] == method]
            cells = " | ".join(number(own, measure) for measure in measures)
            lines.append(f"| {name} | `{method}` | {cells} |")
    return "\n".join(lines)


def _grouped(rows: Sequence[Row], key: str) -> list[tuple[str, Sequence[Row]]]:
    """The rows of each exemplar or of each mesh, with its label."""
    names = labels(row[key] for row in rows)
    return [(name, [row for row in rows if row[key] == value]) for value, name in names.items()]


def keep_pairs(rows: Sequence[Row]) -> None:
    """Writes rows to the file of pairs, whose other rows stay; sorted, numbers with four digits."""
    kept = {}
    if PAIRS.is_file():
        with PAIRS.open(encoding="utf-8", newline="") as file:
            kept = {tuple(row[key] for key in IDENTITY): row for row in csv.DictReader(file)}
    keys, names = [measure.key for measure in LOOKS], labels(row["mesh"] for row in rows)
    for row in rows:
        own = {"exemplar": row["exemplar"], "mesh": names[row["mesh"]], "method": row["method"]}
        numbers = {key: f"{float(row[key]):.4g}" if row[key] else "" for key in keys}
        pair = own | {"seed": row["seed"]} | numbers
        kept[tuple(pair[key] for key in IDENTITY)] = pair
    with PAIRS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [*IDENTITY, *keys], lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept[identity] for identity in sorted(kept))


def pictures(
    rows: Sequence[Row], exemplars: Sequence[str], methods: Sequence[str], meshes: Sequence[str]
) -> np.ndarray:
    """The sheet; each method's first seed."""
    names = labels(row["mesh"] for row in rows)
    first = {(row["exemplar"], row["method"], names[row["mesh"]]): row for row in reversed(rows)}
    pairs = zip(exemplars, cycle(meshes), strict=False)
    images = [read_image(Path(first[e, method, mesh]["picture"])) for e, mesh in pairs for method in methods]
    originals = [picture_of(exemplar) for exemplar in exemplars]
    return sheet(images, len(methods), [*methods] * len(exemplars), exemplar=originals, cell=CELL)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--mesh", default=["vase"], nargs="+", help="that the sheet shows, row by row")
    parser.add_argument("--sheet", default="comparison.jpg", help="its name in the gallery")
    parser.add_argument("--methods", nargs="+", required=True, help="of tables and sheet, in this order")
    parser.add_argument("--pairs", action="store_true", help="keep the numbers of each pair, too")
    parser.add_argument("folders", nargs="+", type=Path)
    arguments = parser.parse_args()
    rows = [row for folder in arguments.folders for row in rows_of(folder)]
    exemplars = list(dict.fromkeys(row["exemplar"] for row in rows))
    groups = [("all", rows), *_grouped(rows, "exemplar"), *_grouped(rows, "mesh")]
    for measures in (LOOKS, COSTS):
        print(table(groups, arguments.methods, measures), end="\n\n")
    if arguments.pairs:
        keep_pairs(rows)
    path = GALLERY / arguments.sheet
    write_image(path, pictures(rows, exemplars, arguments.methods, arguments.mesh))
    print(path)


if __name__ == "__main__":
    main()
