"""Shows what the clustering loss does (section 4.5, figure 11).

usage: python tools/make_nerf_ablation.py RUN CAPTURE WITHOUT

RUN and WITHOUT are finished runs of `mitex fit nerf` on CAPTURE, the second one with `--set clustering=0`.
docs/gallery/nerf-clustering.jpg has a row for each: the first three principal components of synthesized
features as colours, and the texture as a plane. Printed are the features' variance, how many dimensions it
is spread over (its participation ratio), and the distances from photos that table 2 has.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_nerf_gallery import CELL, GALLERY, picture, plane

from mitex.images import write_image
from mitex.methods.baselines.quilted.elevations import compare_elevations
from mitex.methods.nerf import NerfTexture, load_capture
from mitex.methods.nerf.field.networks import FEATURES
from mitex.render import sheet

SIZE = 512  # of the maps that are shown [texels]
SPAN = 3.0  # standard deviations of a component that span its colour


def components(features: np.ndarray) -> np.ndarray:
    """(H, W, 3) in [0, 1] of features (H, W, C)."""
    flat = features.reshape(-1, features.shape[2]).astype(np.float64)
    flat = flat - flat.mean(0)
    _, axes = np.linalg.eigh(np.cov(flat.T))
    values = flat @ axes[:, :-4:-1]
    return (
        (0.5 + values / (SPAN * values.std(0))).clip(0, 1).reshape(*features.shape[:2], 3).astype(np.float32)
    )


def main() -> None:
    run, capture, without = map(Path, sys.argv[1:])
    cells, labels = [], []
    for label, folder in (("clustered", run), ("not clustered", without)):
        texture = NerfTexture.load(folder)
        values = texture.features(texture.model.base.mesh.vertices)[:, :FEATURES]
        spread = np.linalg.eigvalsh(np.cov(values.T.astype(np.float64)))
        dimensions = spread.sum() ** 2 / (spread**2).sum()
        print(f"{label}: variance {spread.sum():.4g}, over {dimensions:.1f} dimensions")
        table = compare_elevations(texture, load_capture(capture))
        print(
            f"{label}: " + ", ".join(f"{row.angle:.0f} degrees {row.ours:.3f}" for row in table), flush=True
        )
        maps = texture.synthesize(SIZE, seed=0, tileable=True)
        cells += [components(maps.features[..., :FEATURES]), picture(texture.apply(plane(), maps), 45)]
        labels += [f"{label}: features", "from 45 degrees"]
    write_image(GALLERY / "nerf-clustering.jpg", sheet(cells, columns=2, labels=labels, cell=CELL))


if __name__ == "__main__":
    main()
