"""Phong shading under a light in spherical harmonics (section 3.1.5; Ramamoorthi and Hanrahan 2001).

A light is the 16 coefficients L_lm of real spherical harmonics up to l = 3, at index l (l + 1) + m, for one
channel or three. The signs are those of `dr.sh_eval`, with the Condon-Shortley phase: for l = 1 the harmonics
go as (-y, z, -x), for l = 2 as (xy, -yz, 2 z^2 - x^2 - y^2, -xz, x^2 - y^2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from mitex.errors import ImageError
from mitex.geometry.vectors import unit
from mitex.methods.nerf.field.tensors import channels
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

A = TypeVar("A", bound=dr.ArrayBase)
COEFFICIENTS = 16  # of a light: l = 0 to 3
BANDS = 3  # values of l that are rendered: 0 to 2
COSINE = (1.0, 2 / 3, 1 / 4, 0.0)  # coefficients of max(cos, 0) / pi, by l
POWER = 1 / 2.4  # of the display curve
TOE = 1e-4  # radiance below which the display curve is a line, of slope 215


def shade(
    normal: mi.Vector3f,
    view: mi.Vector3f,
    kd: mi.Color3f | mi.Float,
    ks: mi.Color3f | mi.Float,
    glossiness: mi.Float,
    light: mi.TensorXf,
) -> mi.Color3f:
    """Radiance that points, at least one, send back along view rays; differentiable in all arguments.

    The diffuse part is kd times the light convolved with the clamped cosine over pi, exactly; the specular
    part is ks times the light convolved with a lobe of coefficients exp(-l^2 / 2g) around the mirrored ray,
    for large g nearly that of cos^g, normalised.

    Args:
        normal: unit normals, `mi.Vector3f`.
        view: unit directions in which the rays travel, from the camera on, `mi.Vector3f`.
        kd: diffuse coefficients in [0, 1], `mi.Color3f` or `mi.Float`.
        ks: specular coefficients in [0, 1], likewise.
        glossiness: g, positive; the larger, the sharper the mirrored light, `mi.Float`.
        light: `mi.TensorXf` of shape (16,), (16, 1) or (16, 3), linear.

    Returns:
        `mi.Color3f`, linear, at least 0; see `to_display`.
    """
    radiance = _coefficients(light, dr.width(normal, view))
    lobe = [dr.exp(-degree * degree / (2 * glossiness)) for degree in range(BANDS)]
    diffuse = kd * _expand(radiance, COSINE[:BANDS], normal)
    specular = ks * _expand(radiance, lobe, view - 2 * dr.dot(normal, view) * normal)
    return dr.maximum(mi.Color3f(diffuse + specular), 0)


def to_display(linear: A) -> A:
    """Values for a display: the power 1/2.4 of linear ones, at least 0.

    Below `TOE` a line to the origin replaces the power, whose derivative is infinite there; that is 1.6 / 255
    off at most.
    """
    line = dr.maximum(linear, 0) * TOE ** (POWER - 1)
    return dr.select(linear < TOE, line, dr.maximum(linear, TOE) ** POWER)


def reflectances(kd: mi.Color3f, ks: mi.Float, light: mi.TensorXf) -> tuple[mi.Color3f, mi.Float]:
    """The linear shares of light that matter reflects which was learned in display values under a light.

    The display curve is applied to coefficients times radiance, so these are no linear reflectances. Those
    returned are, beside a white surface in an even light of the same mean: under it a renderer sees what the
    own light shows.

    Args:
        kd, ks: coefficients in [0, 1] as of `shade`.
        light: that they were learned under, as of `shade`.

    Returns:
        Diffuse `mi.Color3f` and specular `mi.Float`.
    """
    mean = mi.Color3f(_coefficients(light, 1)[0]) / math.sqrt(4 * math.pi)
    mean = dr.maximum(mean, TOE)  # a light that was driven to black has no colour
    learned = mi.Color3f(kd + ks)
    both = _decoded(learned * mean) / _decoded(mean)
    specular = mi.Float(ks * dr.min(both / dr.maximum(learned, 1e-6)))
    return mi.Color3f(both - specular), specular


def _decoded(linear: mi.Color3f) -> mi.Color3f:
    """Radiance that a renderer takes from the display values of linear ones."""
    return mi.Color3f(mi.math.srgb_to_linear(to_display(linear)))


def project_environment(image: np.ndarray) -> np.ndarray:
    """The light of an environment map.

    Args:
        image: (H, W, C) linear radiance, C 1 or 3, in the layout of Mitsuba's `envmap`, not rotated: row 0
            is +y, the columns run from -z over +x, +z and -x back to -z.

    Returns:
        (16, C) float32 spherical harmonics, linear.

    Raises:
        ImageError: another shape, or values that are not finite.
    """
    if image.ndim != 3 or image.shape[2] not in (1, 3) or not image.size:
        raise ImageError(f"an environment of shape {image.shape}", "give (H, W, 3) or (H, W, 1)")
    if not np.isfinite(image).all():
        raise ImageError("the environment holds NaN or infinite values", "check the step that made it")
    height, width, channels = image.shape
    azimuth = (np.arange(width) + 0.5) * (2 * math.pi / width)
    polar = (np.arange(height)[:, None] + 0.5) * (math.pi / height)
    up = np.broadcast_to(np.cos(polar), (height, width))
    direction = (np.sin(polar) * np.sin(azimuth), up, -np.sin(polar) * np.cos(azimuth))
    # Exact areas of the pixels on the sphere: together 4 pi at any resolution.
    area = -np.diff(np.cos(np.arange(height + 1) * (math.pi / height))) * (2 * math.pi / width)
    weighted = image * area[:, None, None]
    basis = dr.sh_eval(mi.Vector3f(*(_flat(axis) for axis in direction)), 3)
    light = [[dr.sum(y * _flat(weighted[..., c]))[0] for c in range(channels)] for y in basis]
    return np.array(light, np.float32)


def rotated(light: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """A light that is turned.

    Args:
        light: (16,) or (16, C) spherical harmonics.
        turn: (3, 3) rotation.

    Returns:
        As `light`, float32: what it was in direction d, it is in direction turn d.
    """
    directions = unit(np.random.default_rng(0).normal(size=(8 * COEFFICIENTS, 3)))
    turned_back = directions @ turn
    values = _harmonics(turned_back) @ light
    return np.linalg.lstsq(_harmonics(directions), values, rcond=None)[0].astype(np.float32)


def _harmonics(directions: np.ndarray) -> np.ndarray:
    """(N, 16) real spherical harmonics of unit directions (N, 3)."""
    values = dr.sh_eval(channels(mi.Vector3f, directions), 3)
    # The first harmonic is one number.
    return np.stack([np.broadcast_to(np.array(y), len(directions)) for y in values], axis=1)


def _coefficients(light: mi.TensorXf, count: int) -> list[mi.Float | mi.Color3f]:
    """The coefficients that are rendered, for `count` points, `mi.Float`s or `mi.Color3f`s."""
    kind = mi.Color3f if light.shape[-1] == 3 else mi.Float
    # One index a point, not one for all: the gradients are then summed where they arise, five times as fast.
    return [dr.gather(kind, light.array, dr.full(mi.UInt32, k, count)) for k in range(BANDS**2)]


def _expand(
    radiance: Sequence[mi.Float | mi.Color3f],
    weights: Sequence[float] | Sequence[mi.Float],
    direction: mi.Vector3f,
) -> mi.Float | mi.Color3f:
    """sum_lm weight_l L_lm Y_lm(direction)."""
    basis = dr.sh_eval(direction, len(weights) - 1)
    terms = [y * coefficient for y, coefficient in zip(basis, radiance, strict=True)]
    total: mi.Float | mi.Color3f = mi.Float(0.0)
    for degree, weight in enumerate(weights):
        total += weight * sum(terms[degree * degree : (degree + 1) ** 2])
    return total


def _flat(values: np.ndarray) -> mi.Float:
    """All values in a row."""
    return upload(mi.Float, np.ascontiguousarray(values, np.float32).ravel())
