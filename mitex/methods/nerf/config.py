"""Settings of the radiance-field texture."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mitex.errors import ConfigError
from mitex.training.config import check_ranges


@dataclass(frozen=True)
class NerfConfig:
    """Settings of a fit; keys as in `--set key=value`.

    Attributes:
        preset: its name.
        steps: of the training.
        seed: of all randomness.
        rays: in a step.
        one_view: all rays of a step from one picture, as published; else from all pictures.
        ray_steps: that the diagonal of the scene cube is divided into.
        table: binary logarithm of the entries of a level's hash table.
        coarsest, finest: resolution of the first and the last level of features [per scene cube].
        density_width: channels of the density network's hidden layer.
        lr: learning rate, times 0.1 after `lr_steps`.
        lr_steps: as said.
        average: decay of the running mean of the parameters, the model that is kept, per 16 steps.
        learn_light: the light is learned with the field, as published; else it stays as the photos and the
            base shape tell it.
        fresnel: surfaces mirror more or less at grazing angles; else as much from all sides, as published.
        detach_normals: fine normals learn from the density alone, as published; else from colours too.
        clustering, distortion, normals: weights of the losses.
        interior_weight: of the loss that, from half of `lr_steps` on, gives the unseen interior the
            reflectances of the surface above; as published there is none, and a cut shell shows any colour.
        cluster_entries: entries of a level that a step clusters, drawn by chance; 0 for all, as published.
        normal_rays: share of the rays whose normals are compared.
        repulsion: pseudo-distance of the direction away from the nearest vertex, beside those of the normals.
        neighbours: vertices whose normals make the coarse normal.
        occupancy: cells of the occupancy grid along a side.
        refine_cameras: optimize the poses too.
        base_steps: of the coarse field that the base shape is taken from.
        concavity: how far the base shape may be from convex pieces (CoACD's threshold); more than the
            height of the meso-structure beside the object, or its rows are cut apart.
        checkpoint_every, preview_every: steps between them.
    """

    preset: str = "fast"
    steps: int = 40_000
    seed: int = 0
    rays: int = 4096
    one_view: bool = True
    ray_steps: int = 1024
    table: int = 19
    coarsest: int = 512
    finest: int = 1024
    density_width: int = 32
    lr: float = 1e-2
    lr_steps: int = 40_000
    average: float = 0.95
    learn_light: bool = True
    fresnel: bool = False
    detach_normals: bool = True
    clustering: float = 1e-5
    distortion: float = 1e-2
    normals: float = 1.0
    interior_weight: float = 0.0
    cluster_entries: int = 0
    normal_rays: float = 1.0
    repulsion: float = 0.01
    neighbours: int = 8
    occupancy: int = 128
    refine_cameras: bool = False
    base_steps: int = 1_000
    concavity: float = 0.3
    checkpoint_every: int = 500
    preview_every: int = 1_000

    def __post_init__(self) -> None:
        check_ranges(
            self,
            steps=(1, None),
            seed=(0, 2**32 - 1),
            rays=(1, 1 << 20),
            ray_steps=(16, 8192),
            table=(8, 24),
            coarsest=(2, 8192),
            finest=(2, 8192),
            density_width=(1, 1024),
            lr=(0, 1),
            lr_steps=(1, None),
            average=(0, 0.9999),
            clustering=(0, None),
            distortion=(0, None),
            normals=(0, None),
            interior_weight=(0, None),
            cluster_entries=(0, None),
            normal_rays=(0, 1),
            repulsion=(1e-6, None),
            neighbours=(1, 64),
            occupancy=(8, 512),
            base_steps=(1, None),
            concavity=(0.01, 1),
            checkpoint_every=(1, None),
            preview_every=(0, None),
        )
        if self.finest < self.coarsest:
            raise ConfigError(f"finest = {self.finest} is coarser than {self.coarsest}", "raise finest")


PAPER = NerfConfig(preset="paper")
PRESETS = {
    # Tables of 2^17 entries have room for the surface's cells at 64 to 512; with the published resolutions
    # these share entries, and colours learn half as fast.
    "fast": replace(
        PAPER,
        preset="fast",
        steps=6_000,
        lr_steps=6_000,
        one_view=False,
        ray_steps=512,
        table=17,
        coarsest=64,
        finest=512,
        density_width=64,
        learn_light=False,
        fresnel=True,
        detach_normals=False,
        cluster_entries=1 << 14,
        normals=0.05,
        interior_weight=0.01,
        normal_rays=0.25,
        repulsion=0.05,
    ),
    "paper": PAPER,
}
