"""Measures how near textures of `nca` come to their exemplars, map by map.

usage: python tools/compare_looks.py EXEMPLARS EXEMPLAR=MODEL[,MODEL ...] ... [--meshes M ...]

EXEMPLARS is a folder; names of embedded exemplars work too. A MODEL is a bundled one, a file or a run folder.
Six patches of a sphere, at the exemplar's scale, are compared with the exemplar: the Frechet distances of
VGG-16's features at relu2_2 and relu4_1, the relaxed transport over five layers, and the regularity beside
the exemplar's. On other meshes, patches are half as wide. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from mitex.evaluation.metrics import single_image_frechet, whole_cells
from mitex.evaluation.regularity import regularity
from mitex.exemplar import Exemplar
from mitex.exemplar import names as exemplar_names
from mitex.features import Vgg16
from mitex.losses import relaxed_transport
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.surfaces import TrainingSphere
from mitex.scenes.cameras import Cameras, patch_views

SPHERE = "sphere"
PATCHES, WIDEST, SIDE = 6, 0.65, 256
TRIES = 8  # places on a mesh for each patch that is compared: some look past thin parts
FREQUENCIES = {True: 32, False: 48}  # of the training spheres, with a decoder and without
FRECHET = ("relu2_2", "relu4_1")
LAYERS = ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("exemplars", type=Path)
    parser.add_argument("looks", nargs="+", metavar="EXEMPLAR=MODEL")
    parser.add_argument("--meshes", nargs="+", default=[SPHERE])
    arguments = parser.parse_args()
    titles = "exemplar | map | model | surface | relu2_2 | relu4_1 | transport | regularity"
    print(f"| {titles} |\n" + "| --- " * 8 + "|")
    for word in arguments.looks:
        name, models = word.split("=")
        source = Exemplar.load(name if name in exemplar_names() else arguments.exemplars / name)
        exemplar = source.resized(min(SIDE, *source.size))
        for model, mesh in ((model, mesh) for model in models.split(",") for mesh in arguments.meshes):
            maps, masks = patches(NcaTexture.load(model), exemplar.size[0], mesh)
            for map_name, views in maps.items():
                target = rgb(exemplar.maps[map_name])
                numbers = " | ".join(f"{value:.3g}" for value in distances(target, views, masks))
                orders = [regularity(view, mask) for view, mask in zip(views, masks, strict=True)]
                order = f"{np.mean(orders):.2f} of {regularity(target):.2f}"
                surface = Path(mesh).stem
                print(f"| {name} | {map_name} | {model} | {surface} | {numbers} | {order} |", flush=True)


@torch.no_grad()
def patches(texture: NcaTexture, size: int, surface: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Patches (K, h, w, 3) of each map, in which the exemplar is `size` [px] wide, and what shows surface."""
    decoded = hasattr(texture.look.decoder, "network")
    mesh = icosphere(FREQUENCIES[decoded]) if surface == SPHERE else cells(surface, decoded)
    ground, state = TrainingSphere.of(mesh, texture.look), texture.grow(mesh)
    edge = math.sqrt(4 / math.sqrt(3) * float(mesh.face_areas.sum()) / len(mesh.faces))
    width = float(texture.about["density"]) * edge
    half = min(0.5 * width, WIDEST) if surface == SPHERE else 0.25 * width
    count = PATCHES if surface == SPHERE else PATCHES * TRIES
    pixels = round(size * 2 * half / width)
    cameras = patch_views(torch.Generator().manual_seed(0), mesh, count, half, pixels)
    cameras = most_covered(ground, cameras)
    views = ground.views(texture.look, state, cameras, antialias=2).clamp(0, 1).numpy()
    masks = np.all(np.asarray(ground.stage.hits(cameras, 2).hit).reshape(*cameras.shape, 4), axis=3)
    return {name: rgb(views[..., list(columns)]) for name, columns in texture.look.layout.items()}, masks


def most_covered(ground: TrainingSphere, cameras: Cameras) -> Cameras:
    """The `PATCHES` cameras that see the most surface, the first ones where several see as much."""
    hit = np.asarray(ground.stage.hits(cameras, 1).hit).reshape(len(cameras), -1)
    best = np.argsort(-hit.mean(1), kind="stable")[:PATCHES]
    return replace(cameras, origin=cameras.origin[best], target=cameras.target[best], up=cameras.up[best])


def cells(name: str, decoded: bool) -> Mesh:
    """The automaton's mesh; without a decoder it needs twice as many cells along an edge."""
    mesh = Cells.dense(Mesh.load(name)).mesh
    return mesh if decoded else Cells.dense(mesh, 1).mesh


def rgb(image: np.ndarray) -> np.ndarray:
    """Three channels, of which one is repeated if there is only one."""
    return np.ascontiguousarray(np.repeat(image, 3 // image.shape[-1], axis=-1), np.float32)


def distances(target: np.ndarray, views: np.ndarray, masks: np.ndarray) -> list[float]:
    """Means over the views: Frechet distances of `FRECHET`, then the transport."""
    pairs = list(zip(views, masks, strict=True))
    frechet = [
        [single_image_frechet(target, view, layer=layer, mask_b=mask) for view, mask in pairs]
        for layer in FRECHET
    ]
    return [*(float(np.mean(values)) for values in frechet), transport(target, views, masks)]


@torch.no_grad()
def transport(target: np.ndarray, views: np.ndarray, masks: np.ndarray) -> float:
    """Relaxed transport (MeshNCA, equation 4), summed over layers, of up to 2,048 random features each."""
    network, generator = Vgg16("max", precision="float32"), torch.Generator().manual_seed(0)
    total = 0.0
    for layer in LAYERS:
        theirs = some(
            network.features(torch.from_numpy(target)[None], [layer])[layer].flatten(1, 2), generator
        )
        for view, mask in zip(views, masks, strict=True):
            (features,) = network.features(torch.from_numpy(view)[None], [layer])[layer]
            whole = whole_cells(view, mask, layer)
            ours = some(features[torch.from_numpy(whole)][None], generator)
            total += float(relaxed_transport(ours, theirs)) / len(views)
    return total


def some(vectors: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """(1, n, C) random ones of (1, N, C)."""
    return vectors[:, torch.randperm(vectors.shape[1], generator=generator)[:2048]]


if __name__ == "__main__":
    main()
