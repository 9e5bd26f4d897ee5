"""Measures how near textures of `nca` come to their exemplars, map by map.

usage: python tools/compare_looks.py EXEMPLARS EXEMPLAR=MODEL[,MODEL ...] ... [--meshes M ...]

EXEMPLARS is a folder; names of embedded exemplars work too. A MODEL is a bundled one, a file or a run folder.
Six patches of a sphere, at the exemplar's scale, are compared with the exemplar by their features
(`mitex.evaluation.likeness`) and their regularity. On other meshes, patches are half as wide.
Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import torch

from mitex.evaluation.likeness import Likeness, exemplar_patches, likeness, patch_features
from mitex.evaluation.patches import filled
from mitex.evaluation.regularity import regularity
from mitex.exemplar import Exemplar
from mitex.exemplar import names as exemplar_names
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.scenes.cameras import Cameras, patch_views

SPHERE = "sphere"
PATCHES, WIDEST, SIDE = 6, 0.65, 256
TRIES = 8  # places on a mesh for each patch that is compared: some look past thin parts
FREQUENCIES = {True: 32, False: 48}  # of the training spheres, with a decoder and without


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("exemplars", type=Path)
    parser.add_argument("looks", nargs="+", metavar="EXEMPLAR=MODEL")
    parser.add_argument("--meshes", nargs="+", default=[SPHERE])
    arguments = parser.parse_args()
    titles = "exemplar | map | model | surface | relu2_2 | relu4_1 | transport | Gram | regularity"
    print(f"| {titles} |\n" + "| --- " * 9 + "|")
    for word in arguments.looks:
        name, models = word.split("=")
        source = Exemplar.load(name if name in exemplar_names() else arguments.exemplars / name)
        exemplar = source.resized(min(SIDE, *source.size))
        for model, mesh in ((model, mesh) for model in models.split(",") for mesh in arguments.meshes):
            maps, masks = patches(NcaTexture.load(model), exemplar.size[0], mesh)
            for map_name, views in maps.items():
                target = rgb(exemplar.maps[map_name])
                numbers = " | ".join(f"{value:.3g}" for value in astuple(distances(target, views, masks)))
                orders = [regularity(view, mask) for view, mask in zip(views, masks, strict=True)]
                order = f"{np.mean(orders):.2f} of {regularity(target):.2f}"
                surface = Path(mesh).stem
                print(f"| {name} | {map_name} | {model} | {surface} | {numbers} | {order} |", flush=True)


@torch.no_grad()
def patches(texture: NcaTexture, size: int, surface: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Patches (K, h, w, 3) of each map, in which the exemplar is `size` [px] wide, and what shows surface."""
    decoded = hasattr(texture.look.decoder, "network")
    mesh = icosphere(FREQUENCIES[decoded]) if surface == SPHERE else cells(surface, decoded)
    ground, state = TrainingMesh.of(mesh, texture.look), texture.grow(mesh)
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


def most_covered(ground: TrainingMesh, cameras: Cameras) -> Cameras:
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


def distances(target: np.ndarray, views: np.ndarray, masks: np.ndarray) -> Likeness:
    """Of the patches, as a set, from as many of the exemplar."""
    ours, theirs = (filled(views, masks), masks), exemplar_patches(target, masks)
    return likeness(patch_features(ours), patch_features(theirs))


if __name__ == "__main__":
    main()
