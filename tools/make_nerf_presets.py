"""Shows what two settings of the radiance-field texture learn from the same photos.

usage: python tools/make_nerf_presets.py CAPTURE RUN RUN

The runs are finished ones of `mitex fit nerf` on CAPTURE. docs/gallery/nerf-presets.jpg has a photo that was
held out and the same view of both, whole and near by. The quality of all held-out views is printed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_nerf_gallery import GALLERY

from mitex.evaluation.views import view_quality
from mitex.images import write_image
from mitex.methods.nerf import NerfTexture, load_capture
from mitex.methods.nerf.config import PRESETS
from mitex.methods.nerf.field.rendering import render_views
from mitex.render import sheet
from mitex.training.config import resolve

CELL = 400  # side of a picture [px]
VIEW = 2  # the held-out photo that is shown
NEAR = 0.15  # half of what is shown of it near by, as a part of its sides


def near(image: np.ndarray) -> np.ndarray:
    """The middle of an image (H, W, 3)."""
    (top, left), (bottom, right) = (
        [round(side * (0.5 + part)) for side in image.shape[:2]] for part in (-NEAR, NEAR)
    )
    return image[top:bottom, left:right]


def main() -> None:
    capture, *runs = map(Path, sys.argv[1:])
    cells, labels = [], ["held out"]
    for run in runs:
        texture = NerfTexture.load(run)
        _, held = load_capture(capture).within(texture.similarity).split()
        for across in (2, 1):
            views = list(render_views(texture.shell, held, across=across))
            print(f"{run.name}, {across} x {across} rays a pixel: {view_quality(views)}", flush=True)
        view, photo = views[VIEW]
        cells += [view] if cells else [photo, view]
        labels.append(resolve(PRESETS, file=run / "config.toml").preset)
    write_image(
        GALLERY / "nerf-presets.jpg",
        sheet(cells + [near(cell) for cell in cells], columns=3, labels=labels + ["near by"] * 3, cell=CELL),
    )


if __name__ == "__main__":
    main()
