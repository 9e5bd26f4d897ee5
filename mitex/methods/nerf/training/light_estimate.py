"""The light that photos were taken in, from how the brightness of the base shape goes with its normals.

A radiance field cannot tell light from colour: k_d can hold the shades as well, and then they do not change
when the texture is turned. Over the whole object, though, the colours of a texture do not depend on where the
surface faces. What does depend on it is light (inverse lighting, as Marschner and Greenberg 1997 have it, in
the harmonics of Ramamoorthi and Hanrahan 2001).
"""

from __future__ import annotations

import math

import numpy as np

from mitex.geometry.vectors import unit
from mitex.mesh import Mesh
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.field.lighting import BANDS, COEFFICIENTS, COSINE, POWER
from mitex.methods.nerf.field.raycast import Raycaster
from mitex.methods.nerf.field.tensors import channels
from mitex.runtime.jit import dr, mi

STRIDE = 4  # every so many pixels of a photo are looked at
SOLID = 0.5  # alpha of pixels that count
STEEP = 75.0  # angle to the normal of pixels that count, at most [degrees]
ALBEDO = 0.25  # assumed mean of k_d: what is up to four times as bright keeps its k_d below 1
PRIOR = 1e-3  # how much an even light is preferred [of the weight of all pixels]
DARKEST = 0.01  # mean radiance of photos that a light is made for, at least
SHADE = 0.25  # light on the darkest side, at least [of the mean]
ROUNDS = 100  # in which light and exposures are solved for in turn
DIRECTIONS = 2000  # in which the light is evaluated for that


def estimated_light(mesh: Mesh, capture: Capture, exposures: bool = False) -> np.ndarray:
    """The light under which a base shape of k_d = 1/4 looks as in its photos, by least squares.

    Args:
        mesh: base shape in the scene cube.
        capture: its photos.
        exposures: whether each photo was exposed in its own way, by an unknown factor; the geometric mean of
            all is 1.

    Returns:
        (16,) float32 spherical harmonics, see `lighting`; zero above l = 2. No side is darker than a quarter
        of the mean. Dim even light where the photos are black or do not see the mesh.
    """
    grams, brights = _normal_equations(mesh, capture)
    light = np.zeros(COEFFICIENTS)
    if len(grams):
        first = _solution(grams, brights, np.ones(len(grams)))
        light[: BANDS**2] = (_exposed(grams, brights, first) if exposures else first) / ALBEDO
    light[0] = max(light[0], DARKEST / ALBEDO * math.sqrt(4 * math.pi))
    return _softened(light).astype(np.float32)


def _normal_equations(mesh: Mesh, capture: Capture) -> tuple[np.ndarray, np.ndarray]:
    """Those of the light of each of the V photos that see the mesh: (V, 9, 9) and (V, 9)."""
    raycaster = Raycaster(mesh, capture)
    grams, brights = [], []
    for view in range(len(capture)):
        hits = raycaster(view, STRIDE)
        image = capture.images[view][::STRIDE, ::STRIDE].astype(np.float64) / 255
        valid = (hits.angle < STEEP) & (image[..., 3] > SOLID)
        if valid.any():
            basis = _irradiance(hits.normals[valid])
            grams.append(basis.T @ basis)
            brights.append(basis.T @ (image[valid][:, :3] ** (1 / POWER)).mean(1))
    return np.array(grams), np.array(brights)


def _solution(grams: np.ndarray, brights: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """The light (9,) of photos with known exposures (V,)."""
    gram, bright = np.einsum("v,vij->ij", gains**2, grams), gains @ brights
    prior = PRIOR * gram[0, 0] * np.diag(np.arange(len(bright)) > 0)
    return np.linalg.solve(gram + prior, bright)


def _exposed(grams: np.ndarray, brights: np.ndarray, light: np.ndarray) -> np.ndarray:
    """The light (9,) of photos with unknown exposures, from the one of equal ones: alternating least squares.

    Where a photo is brighter on one side than on the other does not depend on its exposure.
    """
    for _ in range(ROUNDS):
        gains = (brights @ light) / np.maximum(np.einsum("i,vij,j->v", light, grams, light), 1e-12)
        gains = np.maximum(gains, 1e-3)
        light = _solution(grams, brights, gains / np.exp(np.log(gains).mean()))
    return light


def brightness(light: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Display values of a diffuse surface under a light, beside those in even light of the same strength.

    Args:
        light: (16,) spherical harmonics, see `lighting`.
        normals: (N, 3) of length 1.

    Returns:
        (N,) factors; no side counts as darker than a quarter of the mean.
    """
    even = max(float(light[0]) / math.sqrt(4 * math.pi), DARKEST)
    shades = _irradiance(normals) @ light[: BANDS**2]
    return (np.maximum(shades, SHADE * even) / even) ** POWER


def _softened(light: np.ndarray) -> np.ndarray:
    """The light, nearer to an even one if it leaves a side too dark."""
    directions = unit(np.random.default_rng(0).normal(size=(DIRECTIONS, 3)))
    shades = _irradiance(directions) @ light[: BANDS**2]
    mean = light[0] / math.sqrt(4 * math.pi)
    share = min(1.0, (1 - SHADE) * mean / max(mean - shades.min(), 1e-12))
    return light * np.where(np.arange(COEFFICIENTS) > 0, share, 1.0)


def _irradiance(normals: np.ndarray) -> np.ndarray:
    """What each coefficient of a light gives to surfaces of k_d = 1 with these normals (N, 3); (N, 9)."""
    basis = dr.sh_eval(channels(mi.Vector3f, normals.astype(np.float32)), BANDS - 1)
    weights = np.repeat(COSINE[:BANDS], [2 * degree + 1 for degree in range(BANDS)])
    return np.stack([np.broadcast_to(np.array(y), len(normals)) for y in basis], axis=1) * weights
