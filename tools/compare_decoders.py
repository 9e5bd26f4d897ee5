"""Fits an exemplar with each kind of local coordinates, and measures what comes out.

usage: python tools/compare_decoders.py EXEMPLAR RUNS [SETTING=VALUE ...]

RUNS is where the run folders go: finished ones are used again, begun ones go on. Prints a row for each: the
mean loss of the last 20 steps, the decoder's milliseconds for the views of a step, the Frechet distances of
the albedo to the exemplar's at the exemplar's scale, and the share of the variance that the place within a
triangle explains, of values and of their squared steps, on the even sphere and on one of scattered vertices.
The sheet docs/gallery/nca-decoders.jpg shows a wide view and a close-up of each.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
import torch

from mitex.evaluation.metrics import single_image_frechet
from mitex.evaluation.triangle_pattern import places, triangle_share
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import Mesh, icosphere, scattered_sphere
from mitex.methods.nca import NcaTexture, fit
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.render import sheet
from mitex.scenes.cameras import patch_views
from mitex.training.locate import has_checkpoint

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
KINDS = {
    "waves, smooth": ("coordinates=waves", "interpolation=smooth"),
    "none, smooth": ("coordinates=", "interpolation=smooth"),
    "none, linear": ("coordinates=", "interpolation=linear"),
    "waves, linear": ("coordinates=waves", "interpolation=linear"),
    "barycentrics, linear (published)": ("coordinates=barycentrics", "interpolation=linear"),
    "polynomials, linear": ("coordinates=polynomials", "interpolation=linear"),
    "polynomials and waves, smooth": ("coordinates=polynomials,waves", "interpolation=smooth"),
}
FREQUENCY, CELL = 32, 384


def main() -> None:
    exemplar, runs, *settings = Path(sys.argv[1]), Path(sys.argv[2]), *sys.argv[3:]
    cells, labels = [], []
    for name, own in KINDS.items():
        run = runs / name.replace(", ", "-").replace(" ", "-")
        resume = has_checkpoint(run)
        texture = fit(exemplar, run, set=[*settings, *own], resume=resume)
        wide, close = views(texture)
        print(f"| {name} | " + " | ".join(row(texture, run, exemplar, wide)) + " |", flush=True)
        cells += [wide, close]
        labels += [name, "close-up"]
    write_image(GALLERY / "nca-decoders.jpg", sheet(cells, columns=4, labels=labels, cell=CELL))


@torch.no_grad()
def views(texture: NcaTexture) -> tuple[np.ndarray, np.ndarray]:
    """The albedo on a sphere: as wide as the exemplar, and an eighth of that."""
    mesh = icosphere(FREQUENCY)
    sphere, state = TrainingMesh.of(mesh, texture.look), texture.grow(mesh)
    edge = float(np.sqrt(8 * np.pi / np.sqrt(3) / len(mesh.vertices)))
    half = 0.5 * float(texture.about["density"]) * edge
    pictures = []
    for width in (half, half / 8):
        cameras = patch_views(torch.Generator().manual_seed(0), mesh, 1, width, CELL)
        view = sphere.views(texture.look, state, cameras, antialias=3)[0]
        pictures.append(view[..., list(texture.look.layout["albedo"])].clamp(0, 1).numpy())
    return pictures[0], pictures[1]


def row(texture: NcaTexture, run: Path, exemplar: Path, wide: np.ndarray) -> list[str]:
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    loss = np.mean([line["appearance"] for line in lines[-20:] if "appearance" in line])
    target = Exemplar.load(exemplar).resized(CELL).maps["albedo"]
    distances = [single_image_frechet(target, wide, layer=layer) for layer in ("relu2_2", "relu4_1")]
    spheres = icosphere(FREQUENCY), scattered_sphere(10 * FREQUENCY**2 + 2)
    shares = [f"{share:.4f}" for sphere in spheres for share in triangles(texture, sphere)]
    return [f"{loss:.2f}", f"{decoding(texture):.0f}", *(f"{d:.1f}" for d in distances), *shares]


def decoding(texture: NcaTexture) -> float:
    """Twelve patches of 128 x 128 pixels, forward and backward, the best of three [ms]."""
    mesh = icosphere(FREQUENCY)
    sphere, state = TrainingMesh.of(mesh, texture.look), texture.grow(mesh).requires_grad_()
    cameras = patch_views(torch.Generator().manual_seed(0), mesh, 12, 0.3, 128)
    times = []
    for _ in range(4):
        start = time.perf_counter()
        sphere.views(texture.look, state, cameras, antialias=1).square().sum().backward()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times[1:])


def triangles(texture: NcaTexture, mesh: Mesh) -> tuple[float, float]:
    """Share of the place within a triangle in the values, and in their squared steps along a side."""
    grown = GrownTexture(texture.look, texture.grow(mesh), Cells(mesh, 0, mesh))
    grid, step = places(), np.float32(0.02)
    face = np.repeat(np.arange(len(mesh.faces), dtype=np.int32), len(grid))
    here = np.tile(grid * (1 - step) + step / 3, (len(mesh.faces), 1)).astype(np.float32)
    there = here + np.array([-step / 4, step / 4, 0], np.float32)
    values, moved = grown.values(face, here), grown.values(face, there)
    shape = (len(mesh.faces), len(grid), -1)
    return triangle_share(values.reshape(shape)), triangle_share(((moved - values) ** 2).reshape(shape))


if __name__ == "__main__":
    main()
