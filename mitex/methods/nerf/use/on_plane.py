"""A texture seen along the rays of photos: on its base shape, and on planes that touch it (section 4.3)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, Protocol, TypeVar

import numpy as np

from mitex.evaluation.elevations import HALF
from mitex.evaluation.windows import SOLID, Rendering, Window
from mitex.mesh import Mesh, Similarity, grid
from mitex.methods.nerf.field.lighting import rotated
from mitex.methods.nerf.field.rendering import render_rays
from mitex.methods.nerf.field.shell import Shell
from mitex.methods.nerf.use.applied import AppliedTexture
from mitex.methods.nerf.use.placement import EXTENT
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload
from mitex.textures.march import RadianceField

SIDE = 96  # squares along the plane
SCALE = EXTENT / HALF  # of a texture on the plane, such that it keeps its size in the scene


def plane() -> Mesh:
    """The square [-1, 1]^2 that windows are seen on."""
    mesh = grid(SIDE, SIDE)
    return mesh.with_vertices(HALF * mesh.vertices)


class CapturedRenderer:
    """Renders a texture where it was captured."""

    def __init__(self, shell: Shell) -> None:
        self.shell = shell

    def __call__(self, window: Window) -> Rendering:
        """The base shape as the photo sees it."""
        colour, transmittance = render_rays(self.shell, window.origins, window.directions)
        return window.rendering(colour + transmittance[:, None] * window.background)


class Placed(RadianceField, Protocol):
    """A radiance field around a mesh; `similarity` is the mesh's space -> its cube."""

    similarity: Similarity


Field = TypeVar("Field", bound=Placed)


class PlaneRenderer(ABC, Generic[Field]):
    """Renders a texture on the plane of a window, under the light of the capture.

    Args:
        field: the texture on `plane()`, with `SCALE`.
        light: of the capture, as `turn_light` needs it.
        along: (3,) direction in the scene that the plane's x follows.
    """

    def __init__(self, field: Field, light: np.ndarray, along: np.ndarray) -> None:
        self.field, self.light, self.along = field, light, along

    def __call__(self, window: Window) -> Rendering:
        """The plane as the photo would see it, in place of the base shape."""
        turn, origins, directions = window.to_plane(self.along)
        self.turn_light(turn)
        origins = self.field.similarity.apply(origins)
        colour, transmittance = render_rays(
            self.field, origins.astype(np.float32), directions.astype(np.float32)
        )
        return window.rendering(
            colour + transmittance[:, None] * window.background, 1 - transmittance > SOLID
        )

    @abstractmethod
    def turn_light(self, turn: np.ndarray) -> None:
        """Gives the field the light as it is in the plane's axes, given the rotation (3, 3) into them."""


class TextureOnPlane(PlaneRenderer[AppliedTexture]):
    """Renders a captured texture; its light are (16,) spherical harmonics."""

    def turn_light(self, turn: np.ndarray) -> None:
        self.field.light = upload(mi.TensorXf, rotated(self.light, turn))
