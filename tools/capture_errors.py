"""How far a capture of a film by `film_capture.py` is from the truth.

    python tools/capture_errors.py CAPTURE FILM.mp4 [--sheet PICTURE]

Prints the share of pictures with a camera, angles and places of the cameras after the similarity that fits
best, focal lengths, and how much of the masks overlaps with the true ones. The sheet shows some pictures as
they are and with what the masks leave.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from mitex.methods.nerf import Capture, load_capture


def similarity(source: np.ndarray, target: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Scale, rotation and shift that take points (N, 3) nearest to others (Umeyama 1991)."""
    a, b = source - source.mean(0), target - target.mean(0)
    left, sizes, right = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left * signs) @ right
    scale = float((sizes * signs).sum() / (a**2).sum())
    return scale, rotation, target.mean(0) - scale * rotation @ source.mean(0)


def camera_errors(poses: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles [degrees] and distances between cameras (N, 3, 4) and true ones, (N,) each, once aligned."""
    scale, rotation, shift = similarity(poses[:, :, 3], truth[:, :3, 3])
    places = scale * poses[:, :, 3] @ rotation.T + shift
    turned = np.einsum("ij,njk,nlk->nil", rotation, poses[:, :, :3], truth[:, :3, :3])
    cosine = np.clip((np.trace(turned, axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0)
    return np.degrees(np.arccos(cosine)), np.linalg.norm(places - truth[:, :3, 3], axis=1)


def overlaps(capture: Capture, numbers: np.ndarray, masks: Path) -> np.ndarray:
    """Intersection over union of the masks and the true ones of frames `numbers`, (N,)."""
    values = []
    for image, number in zip(capture.images, numbers, strict=True):
        size = image.shape[1], image.shape[0]
        true = np.asarray(Image.open(masks / f"{number:05}.png").convert("L").resize(size)) > 127
        mask = image[..., 3] > 127
        values.append((mask & true).sum() / (mask | true).sum())
    return np.array(values)


def sheet(capture: Capture, columns: int = 6) -> np.ndarray:
    """(H, W, 3) uint8: pictures from the whole film, and below each what its mask leaves, on white."""
    chosen = [capture.images[k] for k in np.linspace(0, len(capture) - 1, columns).round().astype(int)]
    whole = np.concatenate([image[..., :3] for image in chosen], axis=1)
    cut = np.concatenate([np.where(image[..., 3:] > 127, image[..., :3], 255) for image in chosen], axis=1)
    return np.concatenate([whole, cut])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("capture", type=Path, metavar="CAPTURE")
    parser.add_argument("film", type=Path, metavar="FILM.mp4")
    parser.add_argument("--sheet", type=Path, metavar="PICTURE")
    options = parser.parse_args()
    capture = load_capture(options.capture)
    numbers = np.array([int(Path(name).stem) for name in capture.names])
    with np.load(options.film.with_name(f"{options.film.stem}-truth.npz")) as truth:
        true, focal, radius = truth["poses"][numbers], float(truth["focal"]), float(truth["radius"])
    angles, distances = camera_errors(capture.poses.astype(np.float64), true)
    shares = overlaps(capture, numbers, options.film.with_name(f"{options.film.stem}-masks"))
    print(f"pictures      {len(capture)}")
    print(f"angle         median {np.median(angles):.2f}, largest {angles.max():.2f} degrees")
    distances /= radius
    print(
        f"place         median {np.median(distances):.4f}, largest {distances.max():.4f} radii of the object"
    )
    print(f"focal length  {100 * (capture.intrinsics[:, 0].mean() / focal - 1):+.2f} %")
    print(f"masks         median {np.median(shares):.3f}, least {shares.min():.3f} (IoU)")
    if options.sheet:
        Image.fromarray(sheet(capture)).resize((1680, 420)).save(options.sheet)


if __name__ == "__main__":
    main()
