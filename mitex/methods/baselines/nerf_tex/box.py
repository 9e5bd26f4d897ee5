"""From a captured texture to what NeRF-Tex learns from: pictures of a piece (Huang et al. 2023, section 4.4).

The published system has synthetic pictures of a flat patch in a known box, under known lights. Photos of an
object have neither, so the authors of NeRF-Texture laid a piece of their own texture flat and rendered that.
So does this: a square of the captured surface is laid on a plane, without anything around it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from mitex.errors import ConfigError
from mitex.geometry.vectors import unit
from mitex.mesh import Similarity, grid
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.field.lighting import rotated
from mitex.methods.nerf.field.rendering import render_rays
from mitex.methods.nerf.synthesis.patches import Patches, extract_patches
from mitex.methods.nerf.texture import NerfTexture
from mitex.methods.nerf.use.applied import AppliedTexture
from mitex.methods.nerf.use.placement import EXTENT
from mitex.progress import counted
from mitex.quilting.plane import Quilt
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload

SQUARES = 96  # of the plane along a side
CANDIDATES = 64  # places on the base shape that pieces are taken from
PROBE = 8  # every so many texels of a piece are looked at to tell whether it is like the others
DISTANCE, FIELD = (
    4.0,
    40.0,
)  # of the cameras from the middle [half sides of the cube], and their view [degrees]
NEAREST = 1e-3  # length of the light's first band below which it comes from nowhere


@dataclass(frozen=True)
class Box:
    """A piece of a captured texture, laid flat in the cube [-1, 1]^3.

    Attributes:
        field: the piece; it ends at |x| and |y| = `EXTENT`.
        half: half a side of the cube [scene units of the capture].
        light: (16,) spherical harmonics of the capture.
    """

    field: AppliedTexture
    half: float
    light: np.ndarray


def take_box(texture: NerfTexture, size: int, seed: int) -> Box:
    """The piece of a texture that is most like its others.

    Args:
        texture: captured.
        size: side of the piece [texels], a multiple of 8.
        seed: of the places that it is chosen from.

    Raises:
        ConfigError: no piece fits on the base shape, or the texture is too thick for it.
    """
    base = texture.model.base
    rng = np.random.default_rng(seed)
    squares = extract_patches(
        base.mesh, rng, count=CANDIDATES, size=size, scan=base.scan, thickness=base.thickness
    )
    half = 0.5 * squares.length / EXTENT
    if base.thickness > half:
        raise ConfigError(
            f"a piece {squares.length:.2g} wide is too small for a texture {2 * base.thickness:.2g} thick",
            f"raise `patch` to {8 * math.ceil(size * base.thickness / half / 8)} or more",
        )
    maps = texture.maps(squares, _one_piece(texture, squares, most_typical(texture, squares)))
    plane = grid(SQUARES, SQUARES)
    plane = plane.with_vertices(0.5 * squares.length * plane.vertices)
    return Box(texture.apply(plane, maps, scale=1 / half, lift=0.0), half, np.array(texture.light))


def most_typical(texture: NerfTexture, squares: Patches) -> int:
    """The square whose mean features are nearest to those of all squares."""
    points = squares.points[:, ::PROBE, ::PROBE]
    features = texture.features(points.reshape(-1, 3)).reshape(len(squares), -1, 24).mean(1)
    return int(np.square(features - features.mean(0)).sum(1).argmin())


def _one_piece(texture: NerfTexture, squares: Patches, index: int) -> Quilt:
    """The layout of one square as it is."""
    size = squares.points.shape[1]
    points = squares.points[index]
    features = texture.features(points.reshape(-1, 3)).reshape(size, size, -1)
    texel = np.stack([*np.mgrid[:size, :size]], -1).astype(np.int16)
    which = np.full((size, size), index, np.int32)
    return Quilt(features, which, np.zeros((size, size), np.uint8), texel)


def possible_cells(box: Box, side: int) -> np.ndarray:
    """(side, side, side) bool, cells of the cube that the piece may touch."""
    mask = np.array(box.field.mask).astype(bool)
    wide = ndimage.maximum_filter(mask, size=1 + 2 * math.ceil(len(mask) / side))
    nearest = ((np.arange(side) + 0.5) * len(mask) / side).astype(int)
    return wide[np.ix_(nearest, nearest, nearest)]


def main_direction(light: np.ndarray) -> np.ndarray:
    """(3,) unit vector that most of a light (16,) comes from; z of one that is even."""
    first = np.array([-light[3], -light[1], light[2]], np.float64)
    length = np.linalg.norm(first)
    return first / length if length > NEAREST * abs(light[0]) else np.array([0.0, 0.0, 1.0])


def picture_box(box: Box, count: int, size: int, seed: int) -> tuple[Capture, np.ndarray]:
    """Pictures of a box from the half space above it, each under the capture's light turned anyhow.

    Args:
        box: what is pictured.
        count: pictures.
        size: their side [pixels].
        seed: of places and lights.

    Returns:
        The pictures, with the box's cube as scene cube, and (N, 3) float32 where most light comes from.
    """
    rng = np.random.default_rng(seed)
    towards = unit(rng.normal(size=(count, 3)))
    towards[:, 2] = np.abs(towards[:, 2])
    turns = Rotation.random(count, rng=rng).as_matrix()
    focal = 0.5 * size / math.tan(0.5 * math.radians(FIELD))
    capture = Capture(
        images=tuple(np.zeros((size, size, 4), np.uint8) for _ in range(count)),
        poses=np.stack([_pose(DISTANCE * place) for place in towards]),
        intrinsics=np.tile(np.array([focal, focal, 0.5 * size, 0.5 * size], np.float32), (count, 1)),
        distortion=np.zeros((count, 4), np.float32),
        names=tuple(f"{k:04}.png" for k in range(count)),
        similarity=Similarity(np.zeros(3), 1.0),
        name="box",
    )
    rows, columns = np.mgrid[:size, :size]
    pixels = np.stack([columns.ravel(), rows.ravel()], 1) + 0.5
    for view in counted("picturing the box", range(count), count):
        box.field.light = upload(mi.TensorXf, rotated(box.light, turns[view]))
        colour, transmittance = render_rays(box.field, *capture.rays(view, pixels))
        opacity = 1 - transmittance[:, None]
        straight = colour / np.maximum(opacity, 1e-3)
        rgba = np.concatenate([straight, opacity], 1).clip(0, 1) * 255
        capture.images[view][:] = np.round(rgba).reshape(size, size, 4)
    return capture, (turns @ main_direction(box.light)).astype(np.float32)


def _pose(origin: np.ndarray) -> np.ndarray:
    """(3, 4) of a camera that looks at the middle of the cube."""
    back = unit(origin[None])[0]
    aside = np.cross([0.0, 1.0, 0.0] if abs(back[1]) < 0.9 else [1.0, 0.0, 0.0], back)
    right = unit(aside[None])[0]
    return np.stack([right, np.cross(back, right), back, origin], 1).astype(np.float32)
