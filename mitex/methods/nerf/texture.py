"""`NerfTexture`: a captured texture, to look at, to synthesize more of, and to put on other shapes."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from mitex.atlas import laid_out
from mitex.errors import MeshWarning
from mitex.mesh import Mesh
from mitex.methods.checks import in_range
from mitex.methods.nerf import files
from mitex.methods.nerf.ranges import SIZE
from mitex.methods.nerf.synthesis.maps import LatentMaps, angles_of, latent_maps
from mitex.methods.nerf.synthesis.patch_images import render_patches
from mitex.methods.nerf.synthesis.patches import (
    PATTERN_RATE,
    FeatureSource,
    Patches,
    extract_patches,
    texel_gap,
)
from mitex.methods.nerf.synthesis.patches import SIZE as PATCH
from mitex.methods.nerf.use.applied import AppliedTexture, check_ranges, checked_light, joined_on_surface
from mitex.methods.nerf.use.captured import Captured
from mitex.methods.nerf.use.on_plane import SCALE, TextureOnPlane, plane
from mitex.methods.nerf.use.placement import (
    UNWRAP_SIZE,
    carried_picture,
    guided_side,
    in_scene_cube,
    own_layout,
    too_fine,
)
from mitex.progress import announce
from mitex.quilting.guide import WEIGHT, Guide, SurfaceGuide
from mitex.quilting.plane import Quilt, quilt
from mitex.quilting.surface import quilt_on
from mitex.quilting.target import SurfaceTarget
from mitex.ranges import SEEDS

BLOCK = PATCH // 16  # a guide is compared with patches in 16 x 16 blocks


class NerfTexture(Captured):
    """A texture with meso-structure, captured by `fit`.

    Attributes:
        model: features, networks, light and base shape.
    """

    @property
    def about(self) -> Mapping[str, Any]:
        """How it was made."""
        return self.model.about

    @classmethod
    def load(cls, source: str | Path) -> NerfTexture:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        return cls(files.load(source))

    def save(self, path: str | Path) -> Path:
        """Writes the model file.

        Raises:
            OutputError: the place is not writable.
        """
        return files.save(Path(path), self.model)

    def synthesize(
        self,
        size: int | tuple[int, int] = SIZE,
        seed: int = 0,
        *,
        patches: int = 2000,
        pattern_rate: float = PATTERN_RATE,
        flips: bool = False,
        tileable: bool = False,
        guide: np.ndarray | None = None,
        guide_weight: float = WEIGHT,
        evenness: float | None = None,
    ) -> LatentMaps:
        """More of the texture, in the plane (section 3.2.2).

        Args:
            size: height and width [texels].
            seed: of the patches' places and of all choices.
            patches: how many are taken from the base shape, at most.
            pattern_rate: gap between texels, of the mean edge of the base shape; 1/16 for fine textures.
            flips: use mirrored patches too.
            tileable: the texture continues over its borders.
            guide: a picture that it shall resemble from afar, (H, W, 3) sRGB in [0, 1], stretched over it.
            guide_weight: a colour difference of 1 counts as much as this times the mean distance of patches.
            evenness: how much repetition is avoided; as of `quilt`.

        Raises:
            ConfigError: a number is out of range, the guide is no picture, or no patch fits.
        """
        in_range("`seed`", seed, *SEEDS)
        announce("taking patches of the texture")
        rng = np.random.default_rng(seed)
        squares = self.patches(rng, patches, pattern_rate)
        shape = (size, size) if isinstance(size, int) else size
        target = None
        if guide is not None:
            target = Guide(guide, render_patches(self.shell, squares, BLOCK), guide_weight)
        layout = quilt(
            self.source(squares), shape, rng, flips=flips, tileable=tileable, guide=target, evenness=evenness
        )
        return self.maps(squares, layout)

    def synthesize_on(
        self,
        mesh: Mesh,
        size: int = SIZE,
        seed: int = 0,
        *,
        scale: float = 1.0,
        patches: int = 2000,
        pattern_rate: float = PATTERN_RATE,
        guide: np.ndarray | None = None,
        guide_weight: float = WEIGHT,
        evenness: float | None = None,
    ) -> tuple[Mesh, LatentMaps]:
        """More of the texture, on a mesh: patches lie on its surface, across the borders of charts.

        Args:
            mesh: any.
            size: side of the maps, at most [texels]: where fewer texels are as fine as those of patches, they
                do.
            scale: as of `apply`.
            seed, patches, pattern_rate, guide_weight, evenness: as of `synthesize`.
            guide: a picture that it shall resemble from afar, (H, W, 3) sRGB in [0, 1], which lies once over
                the unit square of the mesh's UVs (if nothing overlaps in them, else it is unwrapped).

        Returns:
            The mesh with new UVs, and the maps on these, for `apply`.

        Raises:
            MeshError: the mesh has no area.
            ConfigError: a number is out of range, the guide is no picture, no patch fits, or `size` is too
                small for the scale.
        """
        in_range("`seed`", seed, *SEEDS)
        check_ranges(scale, density=1.0, lift=1.0)
        gap = texel_gap(self.model.base.mesh, pattern_rate) * scale
        pictured = mesh if guide is None else laid_out(mesh, UNWRAP_SIZE)
        mesh, side = own_layout(mesh, gap, size)
        if side is None:
            raise too_fine(mesh, size)
        picture = None if guide is None else carried_picture(guide, pictured, mesh, side)
        announce("taking patches of the texture")
        rng = np.random.default_rng(seed)
        squares = self.patches(rng, patches, pattern_rate)
        announce("laying the mesh flat around its points")
        target = SurfaceTarget(in_scene_cube(mesh)[0], side, PATCH, gap)
        colours = None
        if picture is not None:
            texels = picture.reshape(-1, 3)[target.texels.index]
            colours = SurfaceGuide(texels, render_patches(self.shell, squares, BLOCK), PATCH, guide_weight)
        layout = quilt_on(self.source(squares), target, rng, evenness=evenness, guide=colours)
        return mesh, replace(self.maps(squares, layout), angle=target.map(angles_of(target)) + layout.angle)

    def source(self, squares: Patches) -> FeatureSource:
        """The features of patches, which are compared by f."""
        return FeatureSource(squares, self.features, len(self.latents.encoding.levels(0)) * 2)

    def covering(self, mesh: Mesh, scale: float = 1.0, pattern_rate: float = PATTERN_RATE) -> int:
        """Side of the texture that the unit square of a mesh's UVs shows once, as a guide asks for [texels].

        Args:
            mesh, scale: as of `apply`.
            pattern_rate: as of `synthesize`.

        Raises:
            MeshError: the mesh has no area.
            ConfigError: the scale is out of range, or the side is smaller than a patch or larger than 8192.
        """
        check_ranges(scale, density=1.0, lift=1.0)
        return guided_side(mesh, texel_gap(self.model.base.mesh, pattern_rate) * scale, PATCH)

    def patches(
        self, rng: np.random.Generator, count: int = 2000, pattern_rate: float = PATTERN_RATE
    ) -> Patches:
        """Squares of the base shape (section 3.2.1); arguments as of `synthesize`."""
        base = self.model.base
        return extract_patches(
            base.mesh, rng, count=count, pattern_rate=pattern_rate, scan=base.scan, thickness=base.thickness
        )

    def maps(self, patches: Patches, layout: Quilt) -> LatentMaps:
        """Latent maps of a quilt of these patches."""
        return latent_maps(patches, layout, self.model.frames)

    def on_plane(self, along: np.ndarray, size: int = 1024, seed: int = 0) -> TextureOnPlane:
        """What shows a synthesized texture in the windows of photos of the capture, under its light.

        Args:
            along: (3,) direction in the scene that the planes' x follows.
            size, seed: as of `synthesize`.
        """
        field = self.apply(plane(), self.synthesize(size, seed, tileable=True), scale=SCALE, lift=0.0)
        return TextureOnPlane(field, np.array(self.light), along)

    def apply(
        self,
        mesh: Mesh,
        maps: LatentMaps | None = None,
        *,
        size: int = SIZE,
        seed: int = 0,
        scale: float = 1.0,
        density: float = 1.0,
        lift: float = 1.0,
        light: np.ndarray | None = None,
        guide: np.ndarray | None = None,
        quilting: Literal["surface", "plane"] | None = None,
    ) -> AppliedTexture:
        """Puts the texture on any mesh (section 3.2.4).

        Args:
            mesh: any.
            maps: a synthesized texture of the plane, laid over the mesh's UVs (if nothing overlaps in them,
                else it is unwrapped), or what `synthesize_on` made for this mesh; None synthesizes one.
            size, seed: as of `synthesize` or `synthesize_on`.
            scale: size of the texture's elements beside the whole mesh, against that on the captured object.
            density: factor of the density.
            lift: 1 puts the mesh under the texture's ground, 0 where the base shape was, as published: there
                the texture is carved into the mesh, and thin parts of this leave no room for its ground.
            light: (16,) or (16, 3) spherical harmonics in place of the capture's (`project_environment`).
            guide: without `maps`, a picture that lies once over the unit square of the mesh's UVs, as of
                `synthesize`; `size` is then as the mesh and `scale` ask.
            quilting: without `maps`, "surface" joins patches on the mesh itself, "plane" in the plane, as
                published: then they follow the UVs, and break where these are cut. None: on the surface, but
                in the plane with a guide or, with a warning, if `size` is too small for the scale. On the
                surface, a guide is still seen through the mesh's UVs, and patches go across its borders.

        Raises:
            MeshError: the mesh has no area.
            ConfigError: a number is out of range, the light has another shape or is not finite, or
                `synthesize_on` refuses.
        """
        check_ranges(scale, density, lift)
        light_coefficients = self.light if light is None else checked_light(light)
        on_surface = joined_on_surface(quilting, guide)
        if maps is None and on_surface:
            gap = texel_gap(self.model.base.mesh, PATTERN_RATE) * scale
            if quilting is None and own_layout(mesh, gap, size)[1] is None:
                problem = f"{too_fine(mesh, size).problem}; it is quilted in the plane"
                warnings.warn(problem, MeshWarning, stacklevel=2)
            else:
                mesh, maps = self.synthesize_on(mesh, size, seed, scale=scale, guide=guide)
        if maps is None or maps.angle is None:
            mesh = laid_out(mesh, UNWRAP_SIZE)
        if maps is None:
            side = size if guide is None else self.covering(mesh, scale)
            maps = self.synthesize(side, seed, tileable=True, guide=guide)
        return AppliedTexture(
            mesh,
            maps,
            self.new_decoder(),
            light_coefficients,
            self.model.config,
            thickness=self.model.base.thickness,
            ground=self.ground,
            scale=scale,
            density=density,
            lift=lift,
        )

    def __repr__(self) -> str:
        about = self.model.about
        return f"NerfTexture({about['name']}, {about['steps']} steps)"
