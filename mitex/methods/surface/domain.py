"""The surface that a texture is synthesized on: its mesh and layout, and what is computed of them, once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mitex.atlas import spread
from mitex.cache import content_key
from mitex.geometry.vectors import rotate_about
from mitex.mesh import Mesh
from mitex.mesh.frames import interpolate_frames, vertex_directions
from mitex.methods.surface.borders import Border
from mitex.methods.surface.cache import VERSION, cached_levels
from mitex.methods.surface.config import SIDES, SurfaceConfig
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.levels import POOLS, Levels
from mitex.methods.surface.palette import square_depth
from mitex.methods.surface.scale_map import ScaleMap
from mitex.methods.surface.taps import Surroundings, build
from mitex.progress import announce
from mitex.quilting.target import SurfaceTarget, Target
from mitex.texels import Texels


@dataclass(frozen=True, eq=False)
class SurfaceDomain:
    """A mesh with UVs, its texels, their tangent frames, and the levels of the network.

    Attributes:
        mesh: with the UVs of the texture.
        resolution: side of the texture [texels].
        frames: "smooth" or "fixed", see `vertex_directions`.
        angle: turns the frames counter-clockwise, seen from outside [degrees].
        orientation: (V, 3) where the exemplar's up shall point, in place of `frames`.
        correct, continued: how levels are computed, see `SurfaceConfig`.
        scale_map: where the pattern's size varies, its factors.
        depth: number of levels.
        layout_ratio: of the layout's size on the surface, as `mitex.methods.layout.layout_ratio` tells.
        keep: whether levels that had to be computed are kept in the cache on disk.
    """

    mesh: Mesh
    resolution: int
    frames: str = "smooth"
    angle: float = 0.0
    orientation: np.ndarray | None = None
    correct: bool = True
    continued: bool = True
    scale_map: ScaleMap | None = None
    depth: int = POOLS
    keep: bool = True
    layout_ratio: float = 1.0

    @staticmethod
    def of(
        mesh: Mesh,
        config: SurfaceConfig,
        orientation: np.ndarray | None = None,
        scale_map: ScaleMap | None = None,
        keep: bool = True,
        layout_ratio: float = 1.0,
    ) -> SurfaceDomain:
        """The domain that a synthesis with these settings works on."""
        return SurfaceDomain(
            mesh,
            config.resolution,
            config.frames,
            config.angle,
            orientation,
            config.correct,
            config.continued,
            scale_map,
            max(POOLS + config.scales, square_depth(min(config.wanted_side(), SIDES[1]))),
            keep,
            layout_ratio,
        )

    @property
    def uv(self) -> np.ndarray:
        """(F, 3, 2) the layout."""
        assert self.mesh.uv is not None
        return self.mesh.uv

    @cached_property
    def texels(self) -> Texels:
        """The texels on the surface, N of them."""
        return Texels.rasterize(self.mesh, self.uv, self.resolution)

    @cached_property
    def directions(self) -> np.ndarray:
        """(V, 3) float64 where the exemplar's right points at the vertices, before `angle` turns it."""
        return vertex_directions(self.mesh, self.frames, self.orientation)

    @cached_property
    def tangent_frames(self) -> tuple[np.ndarray, np.ndarray]:
        """Right and up of the texels, (N, 3) float64 each; see `mesh.frames`."""
        texels, angle = self.texels, math.radians(self.angle)
        return interpolate_frames(self.mesh, texels.face, texels.barycentric, self.directions, angle)

    @cached_property
    def factors(self) -> np.ndarray | None:
        """(N,) factors of the pattern's size at the texels; None where it is the same everywhere."""
        if self.scale_map is None:
            return None
        texels = self.texels
        return self.scale_map.at(self.mesh, texels.face, texels.barycentric)

    @property
    def mean_scale(self) -> float:
        """The geometric mean of `factors`, at which the exemplar is read: a pixel of it is a texel there."""
        return 1.0 if self.factors is None else float(np.exp(np.log(self.factors).mean()))

    @property
    def steps(self) -> np.ndarray | None:
        """(N,) steps of the taps at the texels, 1 in the mean [texels]; None where all are 1."""
        return None if self.factors is None else self.factors / self.mean_scale

    def exemplar_side(self, config: SurfaceConfig) -> int:
        """Side of the exemplar [px], a pixel of which becomes a texel where the pattern has its mean size.

        Raises:
            ConfigError: it is too small or too large.
        """
        return config.exemplar_side(self.mean_scale, self.layout_ratio)

    def target(self, patch: int) -> Target:
        """What `mitex.quilting.surface.quilt_on` covers with patches of `patch` texels, as the taps lie."""
        texels, steps = self.texels, self.steps
        turned = rotate_about(self.directions, self.mesh.normals.astype(np.float64), math.radians(self.angle))
        sizes = None
        if steps is not None:
            image = texels.image(steps[:, None])
            sizes = spread(image, image[..., 0] > 0, self.resolution)[..., 0]
        return SurfaceTarget(self.mesh, self.resolution, patch, texels.size, turned, sizes)

    @cached_property
    def tracer(self) -> GeodesicTracer:
        """Geodesics of the mesh."""
        return GeodesicTracer(self.mesh)

    @cached_property
    def levels(self) -> Levels:
        """The levels of the network, from the cache on disk if they were computed before."""
        options = (
            *(self.resolution, self.frames, math.radians(self.angle), self.correct, self.continued),
            *(self.depth, self.orientation, self.steps),
        )
        key = content_key(VERSION, self.mesh.vertices, self.mesh.faces, self.uv, *options)
        return cached_levels(key, self.compute_levels, keep=self.keep)

    def compute_levels(self) -> Levels:
        """The levels, computed anew."""
        announce("following geodesics from every texel")
        border = Border.continued(self.mesh, self.texels, self.tracer) if self.continued else None
        around = Surroundings(
            self.texels, self.tracer, *self.tangent_frames, self.correct, border, self.steps
        )
        return build(around, self.depth)
