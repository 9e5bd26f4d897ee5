"""Settings of the radiance-field texture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.training.settings import TrainingConfig, key


@dataclass(frozen=True)
class RadianceConfig(TrainingConfig):
    """What every radiance field that learns from photos is told."""

    preset: str = "fast"
    steps: int = 6_000
    rays: int = key(4096, "rays in a step", 1, 1 << 20)
    rays_across: int = key(
        1,
        "a pixel is compared with the mean of so many by so many rays, from lr_steps / 2 on; 1: with one, "
        "through its centre",
        1,
        8,
    )
    one_view: bool = key(False, "all rays of a step from one photo (the paper), instead of from all")
    colour_loss: Literal["l1", "l2"] = key(
        "l1", "differences of colours count as they are (the paper), or by their squares: for thin blades"
    )
    ray_steps: int = key(512, "steps of a ray along the diagonal of the scene cube", 16, 8192)
    table: int = key(17, "binary logarithm of the entries of a level's hash table", 8, 24)
    lr: float = key(1e-2, "learning rate", 0, 1)
    lr_steps: int = key(6_000, "steps in which it falls to a tenth", 1)
    average: float = key(
        0.95, "decay, per 16 steps, of the parameters' running mean, which is what a fit returns", 0, 0.9999
    )
    distortion: float = key(1e-2, "weight of the distortion loss", 0)
    occupancy: int = key(128, "cells of the occupancy grid along a side", 8, 512)
    checkpoint_every: int = 500
    preview_every: int = 1_000

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rays < self.rays_across**2:
            raise ConfigError(
                f"rays = {self.rays} are fewer than {self.rays_across} x {self.rays_across} of one pixel",
                "raise rays, or lower rays_across",
            )


@dataclass(frozen=True)
class NerfConfig(RadianceConfig):
    """Settings of a fit; every key can be set from a TOML file or with `--set`."""

    # Tables of 2^17 entries have room for the surface's cells at 64 to 512; with the published resolutions
    # these share entries, and colours learn half as fast.
    coarsest: int = key(64, "resolution of the first level of features [per scene cube]", 2, 8192)
    finest: int = key(512, "resolution of the last level of features [per scene cube]", 2, 8192)
    density_width: int = key(64, "channels of the density network's hidden layer", 1, 1024)
    learn_light: bool = key(
        False, "learn the light with the field (the paper), instead of estimating it beforehand"
    )
    fresnel: bool = key(
        True, "surfaces mirror more or less at grazing angles; the paper: alike at all angles"
    )
    detach_normals: bool = key(
        False, "fine normals learn from the density alone (the paper), instead of from colours too"
    )
    clustering: float = key(1e-5, "weight of the clustering loss", 0)
    normals: float = key(0.05, "weight of the normal loss", 0)
    interior_weight: float = key(
        0.01,
        "weight of the loss that gives the unseen interior the reflectance above it, from lr_steps / 2 on; "
        "the paper: 0, and where a shell is cut any colour shows",
        0,
    )
    cluster_entries: int = key(1 << 14, "entries of a level clustered in a step; 0 for all (the paper)", 0)
    normal_rays: float = key(0.25, "share of the rays whose normals are compared", 0, 1)
    repulsion: float = key(0.05, "pseudo-distance that keeps projections from the nearest vertex", 1e-6)
    neighbours: int = key(8, "vertices whose normals make the coarse normal", 1, 64)
    refine_cameras: bool = key(False, "optimize the poses too")
    exposures: bool = key(False, "learn how bright each photo was taken too, for films whose exposure drifts")
    base_steps: int = key(1_000, "steps of the coarse field that the base shape is taken from", 1)
    concavity: float = key(
        0.3,
        "CoACD's threshold of the base shape: more than the height of the meso-structure beside the object, "
        "or its rows are cut apart",
        0.01,
        1,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.finest < self.coarsest:
            raise ConfigError(f"finest = {self.finest} is coarser than {self.coarsest}", "raise finest")


DEFAULT = NerfConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(
        DEFAULT,
        preset="paper",
        steps=40_000,
        lr_steps=40_000,
        one_view=True,
        ray_steps=1024,
        table=19,
        coarsest=512,
        finest=1024,
        density_width=32,
        learn_light=True,
        fresnel=False,
        detach_normals=True,
        cluster_entries=0,
        normals=1.0,
        interior_weight=0.0,
        normal_rays=1.0,
        repulsion=0.01,
    ),
}
