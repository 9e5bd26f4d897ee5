"""What is told of a capture's ceiling, where it is known: a ball in noise, and a ball in smooth colours."""

import json
import math
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

SIZE, VIEWS = 40, 16
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tools():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        yield import_module("capture_ceiling"), import_module("capture_studio")


def capture(studio, folder: Path, colour) -> float:
    """Writes views of the unit ball in colours of its points; the share of held-out pixels that see it."""
    (folder / "images").mkdir()
    (folder / "truth").mkdir()
    frames, share = [], []
    for k, pose in enumerate(studio.poses(np.random.default_rng(1), VIEWS, 1.0)):
        origin, rays = pose[:3, 3], studio.pixel_rays(pose, SIZE).astype(np.float64)
        middle = -(rays @ origin)
        root = middle**2 - (origin @ origin - 1)
        hit = root > 0
        depth = np.where(hit, middle - np.sqrt(np.where(hit, root, 0)), np.inf)
        image = np.zeros((SIZE, SIZE, 4), np.uint8)
        image[hit, :3] = np.round(255 * colour(origin + rays[hit] * depth[hit, None]))
        image[hit, 3] = 255
        Image.fromarray(image).save(folder / "images" / f"{k}.png")
        np.savez(folder / "truth" / f"{k}.npz", depth=depth)
        frames.append({"file_path": f"images/{k}.png", "transform_matrix": pose.tolist()})
        share.append(hit.mean())
    (folder / "transforms.json").write_text(json.dumps({"frames": frames}))
    return float(np.mean(share[::8]))


def test_nobody_tells_noise(tools, tmp_path):
    ceiling, studio = tools
    rng = np.random.default_rng(0)
    share = capture(studio, tmp_path, lambda points: rng.random((len(points), 3)))
    ceilings = ceiling.ceilings(tmp_path, np.random.default_rng(0))
    for db, count in zip(ceilings, (ceiling.NEAR, ceiling.ALIKE), strict=True):
        # A pixel's own variance, and that of the mean of `count` others.
        assert db == pytest.approx(-10 * math.log10(share * (1 + 1 / count) / 12), abs=0.15)


def test_smooth_colours_are_told(tools, tmp_path):
    ceiling, studio = tools
    capture(studio, tmp_path, lambda points: 0.5 + 0.1 * points)
    assert min(ceiling.ceilings(tmp_path, np.random.default_rng(0))) > 40
