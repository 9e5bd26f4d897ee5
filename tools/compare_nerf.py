"""Compares captured textures with what the paper compares them with: tables, and sheets of pictures.

usage: python tools/compare_nerf.py RUNS CAPTURES NAME ...

RUNS holds a finished run of `mitex fit nerf` for each NAME, CAPTURES its photos. Held-out views are compared
with those of a plain field, trained for the same time into RUNS/plain-NAME (docs/gallery/nerf-views.jpg), and
textures on planes with quilted pictures, seen ever flatter (table 2; docs/gallery/nerf-elevations-NAME.jpg).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from mitex.evaluation.views import view_quality
from mitex.images import write_image
from mitex.methods.baselines import plain_field
from mitex.methods.baselines.quilted.elevations import compare_elevations
from mitex.methods.nerf import NerfTexture, load_capture
from mitex.methods.nerf.field.rendering import render_view, render_views
from mitex.render import sheet
from mitex.training.locate import has_checkpoint

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CELL = 320  # side of a picture [px]
COLUMNS = 8  # windows of each angle


def main() -> None:
    runs, captures, *names = sys.argv[1:]
    cells, labels = [], []
    for name in names:
        texture = NerfTexture.load(Path(runs) / name)
        capture = load_capture(Path(captures) / name).within(texture.similarity)
        elevations(name, texture, capture)
        about, folder = texture.about, Path(runs) / f"plain-{name}"
        plain = plain_field.fit(
            capture,
            folder,
            preset=about["preset"],
            set=[f"seconds={about['seconds']}"],
            resume=has_checkpoint(folder),
        )
        held_out = capture.split()[1]
        fields = {"ours": texture.shell, "plain": plain.field}
        for label, field in fields.items():
            print(f"{name}, {label}: {view_quality(render_views(field, held_out))}", flush=True)
        pairs = [render_view(field, held_out, 0) for field in fields.values()]
        cells += [pairs[0][1], pairs[0][0], pairs[1][0]]
        labels += [f"{name}, held out", "NeRF-Texture", "plain, equal time"]
    write_image(GALLERY / "nerf-views.jpg", sheet(cells, columns=3, labels=labels, cell=CELL))


def elevations(name: str, texture: NerfTexture, capture) -> None:
    """Table 2, and its windows from top to bottom: photo, captured, ours, flat."""
    table = compare_elevations(texture, capture)
    rows = {"as captured": [row.captured for row in table], "ours": [row.ours for row in table]}
    rows |= {flat: [row.flat[flat] for row in table] for flat in table[0].flat}
    rows["photos"] = [row.photos for row in table]
    print(f"{name}: " + ", ".join(f"{row.angle:.0f}" for row in table) + " degrees, mean")
    for label, distances in rows.items():
        values = "  ".join(f"{d:7.3f}" for d in (*distances, np.mean(distances)))
        print(f"{label:28} {values}", flush=True)
    picture = np.concatenate([row.picture[:, : COLUMNS * row.picture.shape[0] // 4] for row in table])
    write_image(GALLERY / f"nerf-elevations-{name}.jpg", picture)


if __name__ == "__main__":
    main()
