"""A radiance-field texture and a quilted picture at ever flatter angles (Huang et al. 2023, table 2)."""

from __future__ import annotations

import numpy as np

from mitex.evaluation.elevations import Elevation, FlatTexture, elevation_table
from mitex.evaluation.windows import PLACES, WINDOW
from mitex.methods.baselines.quilted import quilted_albedo
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.field.raycast import Raycaster
from mitex.methods.nerf.synthesis.patch_images import render_patches
from mitex.methods.nerf.synthesis.patches import principal_direction
from mitex.methods.nerf.texture import NerfTexture
from mitex.methods.nerf.use.on_plane import SCALE, CapturedRenderer, PlaneRenderer, plane

SYNTHESES = 3


def compare_elevations(
    texture: NerfTexture,
    capture: Capture,
    *,
    size: int = 1024,
    patches: int = 2000,
    seed: int = 0,
    window: int = WINDOW,
    places: int = PLACES,
    syntheses: int = SYNTHESES,
) -> list[Elevation]:
    """Table 2 for a texture and its photos; see `elevation_table`.

    Args:
        texture: of `capture`.
        capture: photos.
        size: of both synthesized textures [texels].
        patches: that both are made of, at most.
        seed: of all choices.
        window: side of the windows of photos [pixels].
        places: windows for each angle that are rendered.
        syntheses: of each texture, by seeds from `seed` on.
    """
    capture = capture.within(texture.similarity)
    base = texture.model.base.mesh
    raycaster = Raycaster(base, capture)
    surfaces = [raycaster(view) for view in range(len(capture))]
    squares = texture.patches(np.random.default_rng(seed), patches)
    pictures = render_patches(texture.shell, squares)  # which takes longer than all else
    light, along = np.array(texture.light), principal_direction(base)

    def pair(number: int) -> tuple[PlaneRenderer, FlatTexture]:
        maps = texture.synthesize(size, number, patches=patches, tileable=True)
        image = quilted_albedo(squares, pictures, (size, size), np.random.default_rng(number), tileable=True)
        field = texture.apply(plane(), maps, scale=SCALE, lift=0.0)
        return PlaneRenderer(field, light, along), FlatTexture(image, maps.gap, along)

    return elevation_table(
        capture,
        surfaces,
        CapturedRenderer(texture.shell),
        (pair(number) for number in range(seed, seed + syntheses)),
        seed=seed,
        window=window,
        places=places,
    )
