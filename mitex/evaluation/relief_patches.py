"""Patches of a relief from outside, straight on and aslant: its normals and its curvature as pictures."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin

import numpy as np
import torch
from scipy.ndimage import gaussian_filter
from scipy.spatial import KDTree

from mitex.evaluation.patches import ANTIALIAS, COARSE, Views
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import orthonormal, scatter_add, unit
from mitex.mesh import Mesh
from mitex.scenes.cameras import Cameras, patch_views
from mitex.scenes.stage import Stage

CANDIDATES = 4  # patches that are looked at for each that is taken
ENOUGH = 0.9  # share of a patch that counts, from which one patch is as good as another
DEEP = 0.75  # what lies further before or behind the middle of a patch than this does not count [widths]
SLANT = 45.0  # of every second view, from the normal [degrees]
BLURS = (1.0, 2.0, 4.0)  # standard deviations of the normals that each channel of curvature is of [px]


def relief_cameras(mesh: Mesh, count: int, width: float, pixels: int, seed: int = 0) -> Cameras:
    """Cameras that see patches of a relief, every second one aslant, where outlines tell what it is.

    The normal of the surface below the relief is the direction of the sum of the area vectors nearby. What
    stands on a surface does not change that sum, since those of a closed surface add up to zero.

    Args:
        mesh: the mesh.
        count: of the patches.
        width: of a patch [mesh units].
        pixels: along a patch.
        seed: of the places and of the sides to which views are slanted.
    """
    generator = torch.Generator().manual_seed(seed)
    places = patch_views(generator, mesh, CANDIDATES * count, 0.5 * width, COARSE).target
    middles, normals = _patches(mesh, places, 0.5 * width)
    candidates = Cameras(
        "orthographic",
        origin=middles + DEEP * width * normals,
        target=middles,
        up=orthonormal(np.tile((0.0, 1.0, 0.0), (len(normals), 1)), normals),
        half_width=0.5 * width,
        width=COARSE,
        height=COARSE,
    )
    share = _seen(mesh, candidates, 1)[1].mean((1, 2))
    best = np.argsort(-np.minimum(share, ENOUGH), kind="stable")[:count]
    kept = {name: getattr(candidates, name)[best] for name in ("origin", "target", "up")}
    straight = replace(candidates, **kept, width=pixels, height=pixels)
    return _slanted(straight, np.random.default_rng(seed))


def relief_views(mesh: Mesh, cameras: Cameras) -> dict[str, Views]:
    """What cameras of `relief_cameras` see of a mesh, without light.

    Returns:
        `normals`: in the camera's axes (right, up, towards it), from [-1, 1] to [0, 1]; `curvature`: the
        divergence of the normal along the picture at three scales, from concave (0) over flat (0.5) to convex
        (1). Pixels that do not count look like a plane.
    """
    normals, mask = _seen(mesh, cameras, ANTIALIAS)
    plane = np.where(mask[..., None], normals, (0.0, 0.0, 1.0))
    curvature = np.stack([_curvature(plane, blur) for blur in BLURS], axis=3)
    pictures = {"normals": plane, "curvature": curvature}
    return {name: ((0.5 + 0.5 * values).astype(np.float32), mask) for name, values in pictures.items()}


def _patches(mesh: Mesh, places: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean positions (K, 3) and directions of the summed area vectors of the faces around places (K, 3)."""
    centres = mesh.vertices[mesh.faces].astype(np.float64).mean(1)
    tree = KDTree(centres)
    nearby = tree.query_ball_point(places, np.maximum(radius, tree.query(places)[0] * 1.001))
    patch = np.repeat(np.arange(len(places)), [len(faces) for faces in nearby])
    face = np.concatenate(nearby).astype(np.int64)
    weights = np.maximum(mesh.face_areas[face, None].astype(np.float64), 1e-30)
    total = scatter_add(patch, weights, len(places))
    middles = scatter_add(patch, weights * centres[face], len(places)) / total
    return middles, unit(scatter_add(patch, mesh.face_crosses[face].astype(np.float64), len(places)))


def _slanted(cameras: Cameras, generator: np.random.Generator) -> Cameras:
    """Every second camera moved around its target, to a random side."""
    right, up, forward = cameras.axes()
    angle = generator.uniform(0, 2 * np.pi, (len(cameras), 1))
    side = np.cos(angle) * right + np.sin(angle) * up
    towards = -cos(radians(SLANT)) * forward + sin(radians(SLANT)) * side
    reach = np.linalg.norm(cameras.origin - cameras.target, axis=1, keepdims=True)
    second = (np.arange(len(cameras)) % 2 == 1)[:, None]
    origin = np.where(second, cameras.target + reach * towards, cameras.origin)
    return replace(cameras, origin=origin, up=np.where(second, -forward, up))


def _seen(mesh: Mesh, cameras: Cameras, antialias: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean normals (K, H, W, 3) in the cameras' axes, and bools (K, H, W): what counts of them."""
    hits = Stage(mesh).hits(cameras, antialias)
    hit, face, barycentric = hits.hit.numpy(), hits.face.numpy(), hits.barycentric.numpy()
    camera = np.arange(len(hit))[hit] // (len(hit) // len(cameras))
    right, up, forward = cameras.axes()
    axes = np.stack([right, up, -forward], axis=1)[camera]
    corners = mesh.faces[face]
    points, normals = (interpolate(barycentric, values[corners]) for values in (mesh.vertices, mesh.normals))
    height = ((points - cameras.target[camera]) * axes[:, 2]).sum(1)
    facing = (mesh.face_crosses[face] * axes[:, 2]).sum(1) > 0
    values, counts = np.zeros((len(hit), 3)), np.zeros(len(hit), bool)
    values[hit] = np.einsum("pad,pd->pa", axes, unit(normals))
    counts[hit] = facing & (height > -2 * DEEP * cameras.half_width)
    shape = (*cameras.shape, antialias**2)
    return unit(values.reshape(*shape, 3).mean(3)), np.asarray(counts.reshape(shape).all(3))


def _curvature(normals: np.ndarray, blur: float) -> np.ndarray:
    """(K, H, W) in (-1, 1) of normals (K, H, W, 3)."""
    smooth = gaussian_filter(normals[..., :2], (0, blur, blur, 0))
    along, down = np.gradient(smooth[..., 0], axis=2), np.gradient(smooth[..., 1], axis=1)
    return np.tanh(2 * blur * (along - down))
