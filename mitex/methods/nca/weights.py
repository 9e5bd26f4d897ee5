"""Weights over a mesh: where one texture is, where the other, and where both are."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mitex.errors import ConfigError
from mitex.images import SUFFIXES, bilinear, read_image
from mitex.mesh import Mesh
from mitex.mesh.nearest import surface_points
from mitex.mesh.vertex_files import read_array, read_properties
from mitex.methods.nca.region import AXES, NUMBER
from mitex.paths import expanded

Weights = Callable[[np.ndarray], np.ndarray]
"""From points (P, 3) [mesh units] to weights (P,) float32 in [0, 1]."""

PROPERTIES = (("weight",), ("quality",), ("red",))  # of a PLY file, in this order
MEANING = "weights"
HELP = "give 0 to 1, x, y:LOW:HIGH, X,Y,Z,RADIUS, a .npy or .ply with a value at each vertex, or a .png"


def graft_weights(mesh: Mesh, source: str | Path | float | np.ndarray) -> Weights:
    """Weights over a mesh from what says where they are.

    Args:
        mesh: the mesh.
        source: one of

            - a number: the same weight everywhere;
            - "x", "y" or "z": from 0 at the mesh's lowest point along the axis to 1 at its highest, linearly;
              "y:-0.2:0.3" from 0 at -0.2 to 1 at 0.3 [mesh units], and the other way if the first is larger;
            - "X,Y,Z,RADIUS": 1 within half the radius around a point, and smoothly 0 at the radius;
            - values (V,), or a file that has one for each vertex: .npy, or a .ply with a property `weight`,
              `quality` or `red`;
            - a .png or .jpg that is painted over the mesh's UVs; its red channel counts.

    Raises:
        ConfigError: the source is none of these, or its values are not from 0 to 1, one for each vertex.
        ImageError: an image that cannot be read.
    """
    if isinstance(source, np.ndarray):
        return _interpolated(mesh, source, "the array")
    text = str(source)
    if re.fullmatch(NUMBER, text):
        return _constant(float(text))
    if match := re.fullmatch(rf"([xyz])(?::({NUMBER}):({NUMBER}))?", text):
        return _along(mesh, AXES[match[1]], match[2], match[3])
    if re.fullmatch(rf"{NUMBER}(?:,{NUMBER}){{3}}", text):
        *centre, radius = map(float, text.split(","))
        return _around(np.array(centre), radius)
    return _from_file(mesh, expanded(text), text)


def _constant(value: float) -> Weights:
    _check(np.array([value]), str(value))
    return lambda points: np.full(len(points), value, np.float32)


def _along(mesh: Mesh, axis: int, low: str | None, high: str | None) -> Weights:
    place = mesh.vertices[:, axis].astype(np.float64)
    start, end = (place.min(), place.max()) if low is None or high is None else (float(low), float(high))
    if start == end:
        raise ConfigError(f"weights from {start:g} to {end:g} along an axis", "give two different places")
    return lambda points: _unit((points[:, axis] - start) / (end - start))


def _around(centre: np.ndarray, radius: float) -> Weights:
    if not radius > 0:
        raise ConfigError(f"weights within a radius of {radius:g}", "give a radius above 0")

    def at(points: np.ndarray) -> np.ndarray:
        share = _unit(2 - 2 * np.linalg.norm(points - centre, axis=1) / radius)
        return share * share * (3 - 2 * share)

    return at


def _from_file(mesh: Mesh, path: Path, text: str) -> Weights:
    suffix = path.suffix.lower()
    if suffix not in (".npy", ".ply", *SUFFIXES):
        raise ConfigError(f"'{text}' says nothing about weights", HELP)
    if suffix == ".npy":
        return _interpolated(mesh, read_array(path, MEANING), f"'{text}'")
    if suffix == ".ply":
        (name,), values = read_properties(path, PROPERTIES, MEANING)
        # Colours may be of 255.
        return _interpolated(
            mesh, values / 255 if name == "red" and values.max(initial=0) > 1 else values, f"'{text}'"
        )
    if not path.is_file():
        raise ConfigError(f"there is no file '{text}'", HELP)
    return _painted(mesh, path)


def _interpolated(mesh: Mesh, values: np.ndarray, name: str) -> Weights:
    values = np.squeeze(values)
    if values.shape != (len(mesh.vertices),) or values.dtype.kind not in "fiub":
        shape = f"{values.dtype} of shape {values.shape}"
        raise ConfigError(f"{name} has {shape}", f"give one number for each of {len(mesh.vertices)} vertices")
    _check(values, name)

    def at(points: np.ndarray) -> np.ndarray:
        face, barycentric = surface_points(mesh, points)
        return _unit((barycentric * values.astype(np.float64)[mesh.faces[face]]).sum(axis=1))

    return at


def _painted(mesh: Mesh, path: Path) -> Weights:
    uv = mesh.uv
    if uv is None:
        raise ConfigError(f"'{mesh.name}' has no UVs that '{path.name}' could be painted over", HELP)
    image = read_image(path)[:, :, :1].astype(np.float64)

    def at(points: np.ndarray) -> np.ndarray:
        face, barycentric = surface_points(mesh, points)
        return _unit(bilinear(image, (barycentric[:, :, None] * uv[face]).sum(axis=1))[:, 0])

    return at


def _check(values: np.ndarray, name: str) -> None:
    if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= 1):
        raise ConfigError(f"{name} holds weights that are not from 0 to 1", "scale them, and leave out NaN")


def _unit(values: np.ndarray) -> np.ndarray:
    return np.clip(values, 0, 1).astype(np.float32)
