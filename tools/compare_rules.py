"""Trains variants of the cell rule, and measures what comes out (MeshNCA, supplementary C).

usage: python tools/compare_rules.py EXEMPLAR RUNS [SETTING=VALUE ...]

EXEMPLAR is the name of an embedded one. RUNS is where the run folders go: finished ones are used again, begun
ones go on. Each variant differs in one setting from the first, and a command `mitex fit nca --exemplar
EXEMPLAR --set SETTING=VALUE` trains it. Prints a row for each: the mean loss of the last 20 steps, the
Frechet distances of the albedo from the exemplar's at relu2_2 and relu4_1, weights of the rule, and seconds a
step. Then two grafts on the parent of the bundled models, and their contrast: of a texture of its family, and
of one from nothing. The sheet docs/gallery/nca-ablations.jpg shows all of them.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import torch

from mitex.evaluation.metrics import single_image_frechet
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import Graft, NcaTexture, fit
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.weights import graft_weights
from mitex.render import sheet
from mitex.scenes.cameras import Cameras, patch_views
from mitex.scenes.stage import Stage
from mitex.training.locate import has_checkpoint

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
VARIANTS = {
    "as published": (),
    "degree 0": ("degree=0",),
    "degree 2": ("degree=2",),
    "32 hidden": ("hidden=32",),
    "12 channels": ("channels=12",),
    "24 channels": ("channels=24",),
    "32 channels": ("channels=32",),
}
PARENT = "ceramic"
FREQUENCY, CELL = 32, 320


def main() -> None:
    name, runs, *settings = sys.argv[1], Path(sys.argv[2]), *sys.argv[3:]
    mesh = icosphere(FREQUENCY)
    target = Exemplar.load(name).resized(CELL).maps["albedo"]
    cells, labels = [target], [name]
    for label, own in VARIANTS.items():
        run = runs / label.replace(" ", "-")
        texture = fit(name, run, set=[*settings, *own], resume=has_checkpoint(run))
        picture = albedo(texture, mesh, closeup(texture, mesh))
        print(f"| {label} | " + " | ".join(row(texture, run, target, picture)) + " |", flush=True)
        cells.append(picture)
        labels.append(label)
    stranger = NcaTexture.load(runs / "as-published")
    for label, picture in grafts(mesh, stranger, NcaTexture.load(name)).items():
        cells.append(picture)
        labels.append(label)
    write_image(GALLERY / "nca-ablations.jpg", sheet(cells, columns=6, labels=labels, cell=CELL))


def closeup(texture: NcaTexture, mesh: Mesh) -> Cameras:
    """A view as wide as the exemplar, of a place that is the same for all."""
    edge = float(np.sqrt(8 * np.pi / np.sqrt(3) / len(mesh.vertices)))
    half = 0.5 * float(texture.about["density"]) * edge
    return patch_views(torch.Generator().manual_seed(0), mesh, 1, half, CELL)


@torch.no_grad()
def albedo(texture: NcaTexture | Graft, mesh: Mesh, cameras: Cameras) -> np.ndarray:
    """What one camera sees of a grown texture's albedo (CELL, CELL, 3)."""
    growth = texture.growth_on(Cells(mesh, 0, mesh), mesh)
    state = growth.evolve(growth.seed(), texture.steps, torch.Generator().manual_seed(0))
    grown, hits = growth.texture(state), Stage(mesh).hits(cameras, 2)
    colours = np.zeros((len(hits.hit), 3), np.float32)
    values = grown.values(hits.face.numpy(), hits.barycentric.numpy())
    colours[hits.hit.numpy()] = grown.maps(values)["albedo"]
    return colours.reshape(CELL, CELL, 4, 3).mean(2).clip(0, 1)


def row(texture: NcaTexture, run: Path, target: np.ndarray, picture: np.ndarray) -> list[str]:
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    loss = np.mean([line["appearance"] for line in lines[-20:] if "appearance" in line])
    steps = [line["seconds"] for line in lines if "seconds" in line]
    distances = [single_image_frechet(target, picture, layer=layer) for layer in ("relu2_2", "relu4_1")]
    weights = sum(parameter.numel() for parameter in texture.look.rule.parameters())
    seconds = float(np.median(np.diff(steps)))
    return [f"{loss:.2f}", *(f"{value:.3g}" for value in distances), f"{weights:,}", f"{seconds:.2f}"]


def grafts(mesh: Mesh, stranger: NcaTexture, relative: NcaTexture) -> dict[str, np.ndarray]:
    """Pictures of textures grafted half on the parent, and one of the two finished textures mixed."""
    parent = NcaTexture.load(PARENT)
    stranger = NcaTexture(stranger.look, {**stranger.about, "family": parent.family})
    camera, half = closeup(parent, mesh), graft_weights(mesh, "0.5")
    pictures = {
        "grafted, of one family": albedo(Graft(parent, relative, half), mesh, camera),
        "grafted, of two": albedo(Graft(parent, stranger, half), mesh, camera),
        "pictures mixed": 0.5 * (albedo(parent, mesh, camera) + albedo(relative, mesh, camera)),
    }
    for label, picture in pictures.items():
        print(f"| {label} | contrast {picture.std(axis=(0, 1)).mean():.3f} |", flush=True)
    return pictures


if __name__ == "__main__":
    main()
