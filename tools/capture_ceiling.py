"""How well the held-out views of a synthetic capture could be told at best by someone who knows its geometry.

usage: python tools/capture_ceiling.py CAPTURE ...

Every pixel of a held-out view is given the mean colour of what the other views have nearest to the true
point that it sees: of `NEAR` pixels, and of the `ALIKE` of `POOL` near ones that were seen from the most
similar side. A field has to find the geometry besides; it can exceed this a little, as it knows what a pixel
sees besides its middle.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from capture_studio import pixel_rays
from PIL import Image
from scipy.spatial import KDTree

NEAR, POOL, ALIKE = 16, 64, 8
EVERY = 8  # as `Capture.split` has it
SAMPLES = 8000  # pixels of a held-out view


@dataclass(frozen=True, eq=False)
class Pixels:
    """The P pixels of views that see the object: points, colours in [0, 1], unit rays, (P, 3) each."""

    points: np.ndarray
    colours: np.ndarray
    rays: np.ndarray


def visible_pixels(folder: Path, frames: list[dict]) -> tuple[Pixels, float]:
    """What frames see, and the share of their pixels that see it."""
    views, share = [], []
    for frame in frames:
        path, pose = folder / frame["file_path"], np.array(frame["transform_matrix"])
        depth = np.load(folder / "truth" / f"{path.stem}.npz")["depth"]
        hit = np.isfinite(depth)
        rays = pixel_rays(pose, len(depth))[hit]
        image = np.asarray(Image.open(path), np.float32)[hit, :3] / 255
        views.append((pose[:3, 3] + rays * depth[hit, None], image, rays))
        share.append(hit.mean())
    return Pixels(*(np.concatenate(values) for values in zip(*views, strict=True))), float(np.mean(share))


def ceilings(folder: Path, rng: np.random.Generator) -> tuple[float, float]:
    """PSNR of whole pictures from near pixels, and from near pixels seen from a similar side [dB]."""
    frames = json.loads((folder / "transforms.json").read_text())["frames"]
    training, _ = visible_pixels(folder, [frame for k, frame in enumerate(frames) if k % EVERY])
    held_out, share = visible_pixels(folder, frames[::EVERY])
    some = rng.choice(len(held_out.points), SAMPLES * len(frames[::EVERY]))
    near = np.asarray(KDTree(training.points).query(held_out.points[some], POOL, workers=-1)[1])
    alike = np.einsum("pkd,pd->pk", training.rays[near], held_out.rays[some]).argsort(1)[:, -ALIKE:]
    neighbours = near[:, :NEAR], np.take_along_axis(near, alike, 1)
    errors = [
        ((training.colours[k].mean(1) - held_out.colours[some]) ** 2).mean() * share for k in neighbours
    ]
    return -10 * float(np.log10(errors[0])), -10 * float(np.log10(errors[1]))


def main() -> None:
    for folder in map(Path, sys.argv[1:]):
        near, alike = ceilings(folder, np.random.default_rng(0))
        print(f"{folder.name}: {near:.1f} dB from near pixels, {alike:.1f} dB from alike views", flush=True)


if __name__ == "__main__":
    main()
