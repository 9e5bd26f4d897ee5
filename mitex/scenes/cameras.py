"""Batches of pinhole and orthographic cameras, as plain arrays that every renderer reads the same way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate, scattered
from mitex.geometry.vectors import unit

if TYPE_CHECKING:
    import torch

    from mitex.mesh import Mesh

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Cameras:
    """`K` cameras of one kind and one image size.

    Image row 0 is the top, column 0 the left; samples sit at pixel centres. Directions and positions are in
    the mesh's space and units.

    Attributes:
        kind: "perspective" or "orthographic".
        origin: camera positions, (K, 3) float32.
        target: points looked at, (K, 3) float32.
        up: vectors that point up in the image, (K, 3) float32; need not be orthogonal to the view direction.
        fov: vertical field of view [degrees]; perspective only.
        half_width: half of what a square image spans on both axes [mesh units]; of other images, half of
            their height. Orthographic only.
        width, height: image size [px].

    Raises:
        ConfigError: for shapes that disagree, numbers out of range, or an `up` parallel to the view
            direction.
    """

    kind: Literal["perspective", "orthographic"]
    origin: Array
    target: Array
    up: Array
    fov: float = 60.0
    half_width: float = 1.0
    width: int = 320
    height: int = 320

    def __post_init__(self) -> None:
        for name in ("origin", "target", "up"):
            value = np.atleast_2d(np.asarray(getattr(self, name), dtype=np.float32))
            object.__setattr__(self, name, np.ascontiguousarray(value))
        _check(self)

    def __len__(self) -> int:
        return len(self.origin)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(K, H, W)."""
        return len(self), self.height, self.width

    def axes(self) -> tuple[Array, Array, Array]:
        """Orthonormal (right, up, forward) of every camera, (K, 3) float32 each."""
        forward = unit(self.target.astype(np.float64) - self.origin)
        right = unit(np.cross(forward, self.up.astype(np.float64)))
        up = np.cross(right, forward)
        return right.astype(np.float32), up.astype(np.float32), forward.astype(np.float32)

    def basis(self) -> tuple[Array, Array]:
        """Rays as an affine function of the screen position.

        With screen coordinates x in [-1, 1] (left to right) and y in [-1, 1] (bottom to top), camera k has
        the ray origin `o[k, 0] + x o[k, 1] + y o[k, 2]` and the (not normalised) direction of the same form
        from `d`.

        Returns:
            (o, d), (K, 3, 3) float32 each: [camera, term (constant, x, y), axis].
        """
        right, up, forward = self.axes()
        aspect = np.float32(self.width / self.height)
        zero = np.zeros_like(right)
        if self.kind == "perspective":
            slope = np.float32(math.tan(0.5 * math.radians(self.fov)))
            return (
                np.stack((self.origin, zero, zero), axis=1),
                np.stack((forward, slope * aspect * right, slope * up), axis=1),
            )
        half = np.float32(self.half_width)
        return (
            np.stack((self.origin, half * aspect * right, half * up), axis=1),
            np.stack((forward, zero, zero), axis=1),
        )

    def rays(self) -> tuple[Array, Array]:
        """Rays through the pixel centres: origins and unit directions, (K, H, W, 3) float32 each."""
        o, d = (terms[:, :, None, None, :] for terms in self.basis())
        x = ((np.arange(self.width, dtype=np.float32) + 0.5) * (2 / self.width) - 1)[None, None, :, None]
        y = (1 - (np.arange(self.height, dtype=np.float32) + 0.5) * (2 / self.height))[None, :, None, None]
        origins = o[:, 0] + x * o[:, 1] + y * o[:, 2]
        directions = d[:, 0] + x * d[:, 1] + y * d[:, 2]
        return origins.astype(np.float32), unit(directions).astype(np.float32)

    def sensors(self) -> list[dict[str, Any]]:
        """One Mitsuba sensor dictionary per camera, with a box-filtered float32 film, for `mi.load_dict`."""
        return [self._sensor(index) for index in range(len(self))]

    def _sensor(self, index: int) -> dict[str, Any]:
        from mitex.runtime.jit import mi

        origin, target, up = (
            getattr(self, name)[index].astype(np.float64) for name in ("origin", "target", "up")
        )
        to_world = mi.ScalarTransform4f().look_at(
            origin=origin.tolist(), target=target.tolist(), up=up.tolist()
        )
        sensor: dict[str, Any] = {
            "type": self.kind,
            "film": {
                "type": "hdrfilm",
                "width": self.width,
                "height": self.height,
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
        }
        if self.kind == "perspective":
            sensor |= {"fov": self.fov, "fov_axis": "y", "near_clip": 1e-3, "far_clip": 1e4}
        else:
            # Mitsuba's orthographic image spans [-1, 1] in x; the height follows from the aspect ratio.
            half = self.half_width * self.width / self.height
            to_world = to_world @ mi.ScalarTransform4f().scale([half, half, 1.0])
            sensor |= {"near_clip": 1e-4, "far_clip": 1e4}
        return sensor | {"to_world": to_world}


def random_views(
    generator: torch.Generator,
    count: int,
    distance: float = 2.5,
    fov: float = 60.0,
    resolution: int = 320,
) -> Cameras:
    """The paper's training views: uniform over a sphere around the origin, which they look at, up +y.

    Azimuth a ~ U(0, 2 pi), elevation e = asin U(-1, 1), position d (cos e cos a, sin e, cos e sin a).

    Args:
        generator: source of all randomness.
        count: number of views K.
        distance: of the camera from the origin [mesh units].
        fov: vertical field of view [degrees].
        resolution: image height and width [px].
    """
    import torch

    azimuth, sine = (
        torch.rand(2, count, generator=generator, dtype=torch.float64, device=generator.device).cpu().numpy()
    )
    return _around(2 * math.pi * azimuth, np.arcsin(2 * sine - 1), distance, fov, resolution)


def orbit(
    count: int,
    elevation: float = 17.0,
    distance: float = 2.5,
    fov: float = 60.0,
    resolution: int = 320,
    start: float = 0.0,
) -> Cameras:
    """`count` views on a circle around the +y axis, looking at the origin.

    Args:
        count: number of views K, at azimuths `start + 360 k / K`.
        elevation: above the horizon [degrees].
        distance: of the camera from the origin [mesh units].
        fov: vertical field of view [degrees].
        resolution: image height and width [px].
        start: azimuth of the first view [degrees].
    """
    azimuth = math.radians(start) + 2 * math.pi * np.arange(count) / max(count, 1)
    return _around(azimuth, np.full(count, math.radians(elevation)), distance, fov, resolution)


def turntable(
    frames: int,
    elevation: float = 17.0,
    distance: float = 2.5,
    fov: float = 40.0,
    resolution: int | tuple[int, int] = 512,
) -> Cameras:
    """One turn of the camera around the object in `frames` frames, such that the last frame meets the first.

    The object appears to turn counter-clockwise seen from above. `resolution` is a side or (width, height)
    [px]; the other arguments are those of `orbit`.
    """
    size = (resolution, resolution) if isinstance(resolution, int) else resolution
    azimuth = math.pi / 2 + 2 * math.pi * np.arange(frames) / max(frames, 1)
    return _around(azimuth, np.full(frames, math.radians(elevation)), distance, fov, size)


def patch_views(
    generator: torch.Generator,
    mesh: Mesh,
    count: int,
    half_width: float,
    resolution: int = 96,
    directions: Array | None = None,
) -> Cameras:
    """Orthographic close-ups of area-uniform random surface points, each seen along its inward normal.

    Without `directions`, up in the image is +y projected into the tangent plane (+x where the normal is
    within 1 degree of +-y).
    The camera stands outside the mesh's bounding sphere, so the patch is what an outside observer sees there.
    On a unit sphere every pixel shows surface when `half_width sqrt(2) < 1`.

    Args:
        generator: source of all randomness.
        mesh: the mesh; its interpolated vertex normals point the cameras.
        count: number of patches K.
        half_width: half of a patch's side [mesh units].
        resolution: image height and width [px].
        directions: (V, 3) where right in the image points, across the normals.
    """
    import torch

    numbers = torch.rand(3, count, generator=generator, dtype=torch.float64, device=generator.device)
    face, weight = scattered(mesh.face_areas, numbers.cpu().numpy())
    point = interpolate(weight, mesh.vertices[mesh.faces[face]].astype(np.float64))
    normal = unit(interpolate(weight, mesh.normals[mesh.faces[face]].astype(np.float64)))

    centre = 0.5 * (mesh.vertices.min(0) + mesh.vertices.max(0)).astype(np.float64)
    radius = np.linalg.norm(mesh.vertices - centre, axis=1).max()
    # Beyond the bounding sphere whatever the normal is, and not much further: float32 depth stays precise.
    distance = np.linalg.norm(point - centre, axis=1) + 1.01 * radius + 1e-3
    near_pole = np.abs(normal[:, 1]) > math.cos(math.radians(1))
    up = np.where(near_pole[:, None], (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    if directions is not None:
        up = np.cross(normal, interpolate(weight, directions[mesh.faces[face]]))
    return Cameras(
        "orthographic",
        origin=point + distance[:, None] * normal,
        target=point,
        up=up,
        half_width=half_width,
        width=resolution,
        height=resolution,
    )


def _around(
    azimuth: Array, elevation: Array, distance: float, fov: float, size: int | tuple[int, int]
) -> Cameras:
    """Perspective cameras at spherical positions [rad] that look at the origin, up +y."""
    width, height = (size, size) if isinstance(size, int) else size
    position = np.stack(
        (np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)), axis=1
    )
    # Straight above or below, +y says nothing about the image's up.
    pole = np.abs(position[:, 1:2]) > 1 - 1e-9
    return Cameras(
        "perspective",
        origin=distance * position,
        target=np.zeros_like(position),
        up=np.where(pole, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        fov=fov,
        width=width,
        height=height,
    )


def _check(cameras: Cameras) -> None:
    if cameras.kind not in ("perspective", "orthographic"):
        raise ConfigError(f"unknown camera kind {cameras.kind!r}", "use 'perspective' or 'orthographic'")
    shape = cameras.origin.shape
    vectors: Sequence[Array] = (cameras.origin, cameras.target, cameras.up)
    if len(shape) != 2 or shape[0] < 1 or shape[1] != 3 or any(v.shape != shape for v in vectors):
        shapes = ", ".join(str(v.shape) for v in vectors)
        raise ConfigError(
            f"camera origin, target and up have shapes {shapes}", "give three arrays of one shape (K, 3)"
        )
    if not all(np.isfinite(v).all() for v in vectors):
        raise ConfigError("a camera has a coordinate that is not finite", "check distance, target and mesh")
    if min(cameras.width, cameras.height) < 1:
        raise ConfigError(
            f"image size {cameras.width} x {cameras.height}", "both sides must be at least 1 pixel"
        )
    if cameras.kind == "perspective" and not 0 < cameras.fov < 180:
        raise ConfigError(f"field of view {cameras.fov:g} degrees", "choose one between 0 and 180")
    if cameras.kind == "orthographic" and not 0 < cameras.half_width < math.inf:
        raise ConfigError(f"half_width {cameras.half_width}", "choose a positive number of mesh units")
    forward = cameras.target.astype(np.float64) - cameras.origin
    sine = np.linalg.norm(np.cross(forward, cameras.up.astype(np.float64)), axis=1)
    if (sine <= 1e-6 * np.linalg.norm(forward, axis=1) * np.linalg.norm(cameras.up, axis=1)).any():
        raise ConfigError(
            "a camera's up vector is parallel to its view direction", "choose another up or target"
        )
