"""Patches of a textured surface without light, seen straight on: what textures are compared by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from mitex.asset import CLAY, Asset
from mitex.colour import linear_to_srgb, srgb_to_linear
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import unit
from mitex.images import bilinear
from mitex.mesh import Mesh
from mitex.scenes.cameras import Cameras, patch_views
from mitex.scenes.stage import Hits, Stage

FACING = 0.5  # least cosine between normal and view of a pixel that counts: 60 degrees
ENOUGH = 0.6  # share of a patch that counts, from which one patch is as good as another
CANDIDATES = 6  # patches that are looked at for each that is taken
COARSE = 24  # side of their pictures [px]
ANTIALIAS = 2  # n for n x n rays a pixel

Views = tuple[np.ndarray, np.ndarray]  # images (K, S, S, 3) sRGB in [0, 1], and bools (K, S, S): what counts


def patch_cameras(mesh: Mesh, count: int, width: float, pixels: int, seed: int = 0) -> Cameras:
    """Cameras that see patches of a mesh along their normals, spread at random over its area.

    Patches of which too little faces the camera are passed over, as far as there are others.

    Args:
        mesh: the mesh.
        count: of the patches.
        width: of a patch [mesh units].
        pixels: along a patch.
        seed: of the places.
    """
    candidates = patch_views(
        torch.Generator().manual_seed(seed), mesh, CANDIDATES * count, 0.5 * width, COARSE
    )
    hits = Stage(mesh).hits(candidates)
    share = _counting(mesh, candidates, hits, 1).mean((1, 2))
    best = np.argsort(-np.minimum(share, ENOUGH), kind="stable")[:count]
    places = {name: getattr(candidates, name)[best] for name in ("origin", "target", "up")}
    return replace(candidates, **places, width=pixels, height=pixels)


def albedo_views(asset: Asset, cameras: Cameras) -> Views:
    """What cameras see of an asset's colours, without any light.

    Pixels that do not count, beside the mesh or seen too flatly, have the mean colour of those that do.

    Args:
        asset: with or without textures; one without an albedo is grey.
        cameras: in the space of its mesh.
    """
    hits = Stage(asset.mesh).hits(cameras, ANTIALIAS)
    mask = _counting(asset.mesh, cameras, hits, ANTIALIAS)
    samples = np.zeros((len(hits.hit), 3))
    samples[hits.hit.numpy()] = _colours(asset, hits.face.numpy(), hits.barycentric.numpy())
    linear = samples.reshape(*cameras.shape, ANTIALIAS**2, 3).mean(3)
    return filled(linear_to_srgb(linear.clip(0, 1)), mask), mask


def filled(images: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Images (K, S, S, 3) float32 with the mean of the pixels that count, (K, S, S), at all others."""
    mean = images[mask].mean(0) if mask.any() else CLAY
    return np.where(mask[..., None], images, mean).astype(np.float32)


def _counting(mesh: Mesh, cameras: Cameras, hits: Hits, antialias: int) -> np.ndarray:
    """(K, H, W) bool: pixels whose samples all see the mesh, and not too flatly."""
    normals = unit(mesh.face_crosses)
    view = np.repeat(cameras.axes()[2], cameras.height * cameras.width * antialias**2, axis=0)
    hit = hits.hit.numpy()
    facing = np.zeros(len(hit), bool)
    facing[hit] = -(normals[hits.face.numpy()] * view[hit]).sum(1) > FACING
    return np.all(facing.reshape(*cameras.shape, antialias**2), axis=3)


def _colours(asset: Asset, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """Linear colours (P, 3) at points of an asset's surface, by faces (P,) and barycentrics (P, 3)."""
    if asset.atlas is not None and asset.texture_maps is not None and "albedo" in asset.texture_maps:
        return bilinear(
            srgb_to_linear(asset.texture_maps["albedo"]), interpolate(barycentric, asset.atlas.uv[face])
        )
    albedo = asset.vertex_maps.get("albedo", np.full((len(asset.mesh.vertices), 3), CLAY, np.float32))
    return interpolate(barycentric, srgb_to_linear(albedo)[asset.mesh.faces[face]])
