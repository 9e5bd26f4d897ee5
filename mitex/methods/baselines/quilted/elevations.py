"""A radiance-field texture and quilted pictures at ever flatter angles (Huang et al. 2023, table 2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from mitex.evaluation.elevations import Elevation, FlatTexture, elevation_table
from mitex.evaluation.windows import PLACES, WINDOW
from mitex.methods.baselines.quilted.albedo import in_even_light, quilted_albedo
from mitex.methods.baselines.quilted.texture import plane_brightness
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.field.raycast import Raycaster
from mitex.methods.nerf.synthesis.patch_images import render_patches
from mitex.methods.nerf.synthesis.patches import principal_direction
from mitex.methods.nerf.texture import NerfTexture
from mitex.methods.nerf.use.on_plane import SCALE, CapturedRenderer, TextureOnPlane, plane

SYNTHESES = 3


@dataclass(frozen=True)
class FlatOptions:
    """How a quilted picture is made and looked up.

    Attributes:
        relit: the light of the capture is taken off the pictures of patches, and shines on the plane as it
            does on ours; else each patch keeps the light of the place that it is from.
        even: quilted with our `evenness`; else with none, as published.
        filtered: pixels show the mean of what they cover; else one texel.
    """

    relit: bool
    even: bool
    filtered: bool


FLAT = {
    "2D as published, unfiltered": FlatOptions(relit=False, even=False, filtered=False),
    "2D as published": FlatOptions(relit=False, even=False, filtered=True),
    "2D even": FlatOptions(relit=False, even=True, filtered=True),
    "2D even, relit, unfiltered": FlatOptions(relit=True, even=True, filtered=False),
    "2D": FlatOptions(relit=True, even=True, filtered=True),
}


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
        size: of all synthesized textures [texels].
        patches: that they are made of, at most.
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
    relit = in_even_light(squares, pictures, base, light)

    shine = partial(plane_brightness, light)

    def renderers(number: int) -> tuple[TextureOnPlane, dict[str, FlatTexture]]:
        maps = texture.synthesize(size, number, patches=patches, tileable=True)
        field = texture.apply(plane(), maps, scale=SCALE, lift=0.0)

        @cache
        def quilted(is_relit: bool, even: bool) -> np.ndarray:
            rng, evenness = np.random.default_rng(number), None if even else 0.0
            source = relit if is_relit else pictures
            return quilted_albedo(squares, source, (size, size), rng, tileable=True, evenness=evenness)

        flat = {}
        for name, options in FLAT.items():
            image, shade = quilted(options.relit, options.even), shine if options.relit else None
            flat[name] = FlatTexture(image, maps.gap, along, options.filtered, shade)
        return TextureOnPlane(field, light, along), flat

    return elevation_table(
        capture,
        surfaces,
        CapturedRenderer(texture.shell),
        (renderers(number) for number in range(seed, seed + syntheses)),
        seed=seed,
        window=window,
        places=places,
    )
