"""Latent maps: a texture in the plane, and its features on the UVs of any mesh (section 3.2.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.geometry.triangles import twice_area
from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.mesh.frames import interpolate_frames
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.field.networks import FEATURES, PHASES
from mitex.methods.nerf.field.shell import ShellCoords
from mitex.methods.nerf.synthesis.patches import Patches, mirror_frames
from mitex.methods.nerf.use.placement import uv_unit_length
from mitex.quilting.plane import Quilt
from mitex.quilting.target import SurfaceTarget
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

CHANNELS = FEATURES + PHASES
PACKET = 8  # channels that are gathered at once


@dataclass(frozen=True, eq=False)
class LatentMaps:
    """A synthesized texture. Row 0 is on top; it repeats beyond its borders.

    Attributes:
        features: (H, W, 24) float32 f and f-hat.
        frame: (H, W) int32, which of `frames` turns the fine normal of a texel.
        frames: (K, 3, 3) float32 T_s^-1 T_c of equation 4: from the frame of the captured face to the
            texture's x (right), y (up) and z (outwards).
        gap: between texels [scene units of the capture].
        angle: (H, W) float32 of maps that were synthesized on a mesh, over whose UVs they lie once: from
            dP/du to the texture's x, counter-clockwise seen from outside [rad]. None: 0 everywhere.
    """

    features: np.ndarray
    frame: np.ndarray
    frames: np.ndarray
    gap: float
    angle: np.ndarray | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(H, W)."""
        return self.features.shape[0], self.features.shape[1]


class MappedLatents:
    """Features of a mesh by its UVs.

    Attributes:
        texels: `mi.TensorXf` (H, W, 24) of the maps' features; derivatives reach them.

    Args:
        maps: the texture.
        uv: (F, 3, 2) of the mesh's corners; v points up, one unit is the whole texture.
        frames: (F, 3, 3) rows dP/du, dP/dv and normal of its faces, orthonormal.
    """

    def __init__(self, maps: LatentMaps, uv: np.ndarray, frames: np.ndarray) -> None:
        # Opaque: maps of each size would ask for kernels of their own.
        self._height, self._width = (dr.opaque(mi.Int32, side) for side in maps.size)
        self.texels = upload(mi.TensorXf, maps.features)
        self._which = upload(mi.UInt32, maps.frame.astype(np.uint32).ravel())
        self._turns = upload(mi.Float, np.ascontiguousarray(maps.frames, np.float32).ravel())
        self._uv = upload(mi.Float, np.ascontiguousarray(uv, np.float32).ravel())
        self._frames = upload(mi.Float, np.ascontiguousarray(frames, np.float32).ravel())
        self._angle = None if maps.angle is None else upload(mi.Float, maps.angle.ravel())

    @staticmethod
    def over(mesh: Mesh, maps: LatentMaps, scale: float) -> MappedLatents:
        """Of a mesh in the scene cube, with the texture's elements `scale` times as large as captured."""
        if maps.angle is not None:
            return MappedLatents(maps, np.asarray(mesh.uv), face_frames(mesh))
        # One unit of the UVs shows so many textures, across and up, that elements have the requested size.
        height, width = maps.size
        lengths = maps.gap * scale * np.array([width, height], np.float32)
        return MappedLatents(maps, np.asarray(mesh.uv) * (uv_unit_length(mesh) / lengths), uv_frames(mesh))

    def __call__(self, coords: ShellCoords) -> tuple[list[mi.Float], list[mi.Float]]:
        values = self._blended(coords, CHANNELS)
        return values[:FEATURES], values[FEATURES:]

    def features(self, coords: ShellCoords) -> list[mi.Float]:
        """f alone, which the density needs."""
        return self._blended(coords, FEATURES)

    def frame(self, coords: ShellCoords) -> tuple[mi.Vector3f, mi.Vector3f, mi.Vector3f]:
        """The captured frame's axes, laid on the mesh: equation 4 of each."""
        x, y = self._place(coords)
        texel = self._index(mi.Int32(dr.floor(x + 0.5)), mi.Int32(dr.floor(y + 0.5)))
        turn = dr.gather(mi.UInt32, self._which, texel) * 9
        axes = [dr.gather(mi.Vector3f, self._frames, coords.face * 3 + k) for k in range(3)]
        if self._angle is not None:
            sine, cosine = dr.sincos(dr.gather(mi.Float, self._angle, texel))
            axes[:2] = axes[0] * cosine + axes[1] * sine, axes[1] * cosine - axes[0] * sine
        captured = []
        for axis in range(3):
            parts = [dr.gather(mi.Float, self._turns, turn + 3 * row + axis) for row in range(3)]
            captured.append(axes[0] * parts[0] + axes[1] * parts[1] + axes[2] * parts[2])
        return captured[0], captured[1], captured[2]

    @property
    def parameters(self) -> dict[str, dr.ArrayBase]:
        return {"features": self.texels}

    def _place(self, coords: ShellCoords) -> tuple[mi.Float, mi.Float]:
        """Column and row of the foot [texels], of which whole numbers are centres."""
        corner = [dr.gather(mi.Point2f, self._uv, coords.face * 3 + k) for k in range(3)]
        b, c = coords.barycentric
        uv = corner[0] * (1 - b - c) + corner[1] * b + corner[2] * c
        return uv.x * mi.Float(self._width) - 0.5, (1 - uv.y) * mi.Float(self._height) - 0.5

    def _blended(self, coords: ShellCoords, count: int) -> list[mi.Float]:
        """The first `count` channels, bilinear."""
        x, y = self._place(coords)
        left, top = dr.floor(x), dr.floor(y)
        across, down = x - left, y - top
        total = [mi.Float(0)] * count
        for right in (0, 1):
            for below in (0, 1):
                share = (across if right else 1 - across) * (down if below else 1 - down)
                texel = self._index(mi.Int32(left) + right, mi.Int32(top) + below)
                for k in range(0, count, PACKET):
                    packet = texel * (CHANNELS // PACKET) + k // PACKET
                    shape = (PACKET, dr.width(texel))
                    values = dr.gather(mi.ArrayXf, self.texels.array, packet, shape=shape)
                    for j in range(PACKET):
                        total[k + j] = dr.fma(values[j], share, total[k + j])
        return total

    def _index(self, column: mi.Int32, row: mi.Int32) -> mi.UInt32:
        """Of texels, repeated beyond the borders."""
        return mi.UInt32(_wrapped(row, self._height) * self._width + _wrapped(column, self._width))


def latent_maps(patches: Patches, layout: Quilt, captured: np.ndarray) -> LatentMaps:
    """Latent maps of a quilt: the frames of equation 4 are computed once for each patch and face.

    Args:
        patches: of the base shape.
        layout: made of these.
        captured: (F, 3, 3) T_c of the base shape's faces.
    """
    face = layout.look_up(patches.faces).astype(np.int64)
    faces = len(captured)
    code = (layout.patch.astype(np.int64) * 4 + layout.flip) * faces + face
    unique, frame = np.unique(code, return_inverse=True)
    sampling, face = unique // faces, unique % faces
    turned = mirror_frames(patches.frames[sampling // 4], (sampling % 4).astype(np.uint8))
    frames = np.einsum("kij,klj->kil", turned, captured[face])
    return LatentMaps(
        layout.features,
        frame.reshape(layout.patch.shape).astype(np.int32),
        frames.astype(np.float32),
        patches.gap,
    )


def uv_frames(mesh: Mesh) -> np.ndarray:
    """T~ of equation 4: `face_frames` whose second row is dP/dv, so left-handed in mirrored charts."""
    frames = face_frames(mesh)
    mirrored = twice_area(np.asarray(mesh.uv)) < 0
    frames[mirrored, 1] *= -1
    return frames


def angles_of(target: SurfaceTarget) -> np.ndarray:
    """(N,) float32 [rad] from dP/du of the texels' charts to where the texture's right shall point,
    counter-clockwise seen from outside."""
    face = target.texels.face
    right, _ = interpolate_frames(target.mesh, face, target.texels.barycentric, target.directions)
    t, b = np.moveaxis(face_frames(target.mesh)[face, :2], 1, 0)
    return np.arctan2(dot(right, b), dot(right, t)).astype(np.float32)


def _wrapped(index: mi.Int32, size: mi.Int32) -> mi.Int32:
    rest = index % size
    return dr.select(rest < 0, rest + size, rest)
