"""Pictures of a radiance field along the rays of photos."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.capture.pixels import Batch, Pixels
from mitex.methods.nerf.config import RadianceConfig
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.runtime.jit import dr, mi
from mitex.textures.march import DIAGONAL, RadianceField, composite

CHUNK = 1 << 16  # rays marched at a time
REFINEMENT = 2  # steps of a picture for one of the training; the durian gains 0.4 dB by it
LONGEST = 400  # side of rendered photos [pixels]


def render_step(config: RadianceConfig) -> float:
    """Length of the steps by which a trained field is rendered [scene units]."""
    return DIAGONAL / (REFINEMENT * config.ray_steps)


def batch_rays(batch: Batch) -> tuple[mi.Point3f, mi.Vector3f]:
    """Origins and directions as Dr.Jit arrays."""
    return channels(mi.Point3f, batch.origins), channels(mi.Vector3f, batch.directions)


def render_rays(
    field: RadianceField, origins: np.ndarray, directions: np.ndarray, far: float = math.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Colour and transmittance of R rays.

    Args:
        field: in its cube.
        origins, directions: (R, 3), directions of length 1.
        far: where the rays end [scene units].

    Returns:
        Display colours (R, 3) times opacity, and transmittance (R,) in [0, 1].
    """
    colours, transmittances = [np.zeros((0, 3), np.float32)], [np.zeros(0, np.float32)]
    for start in range(0, len(origins), CHUNK):
        part = slice(start, start + CHUNK)
        origin, direction = channels(mi.Point3f, origins[part]), channels(mi.Vector3f, directions[part])
        pixels = composite(field, origin, direction, dr.full(mi.Float, 0.5, dr.width(origin)), far)
        colours.append(rows(pixels.colour))
        transmittances.append(np.array(pixels.transmittance))
    return np.concatenate(colours), np.concatenate(transmittances)


def render_batch(field: RadianceField, batch: Batch) -> np.ndarray:
    """Display colours (P, 3) in [0, 1] of the batch's pixels, on white."""
    colour, transmittance = render_rays(field, batch.origins, batch.directions)
    return np.clip(batch.pixel_mean(colour + transmittance[:, None]), 0, 1)


def render_view(
    field: RadianceField, capture: Capture, view: int, longest: int = LONGEST, across: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """A view of the field and its photo, (H, W, 3) sRGB in [0, 1], on white.

    Args:
        field: in the scene cube of the capture.
        capture: the photos.
        view: index of one.
        longest: side that the photo is thinned out to [pixels].
        across: a pixel is the mean of so many by so many rays; 1: that of one, through its centre.
    """
    batch, shape = Pixels(capture).image(view, longest, across)
    photo = (batch.colours * batch.alpha + 1 - batch.alpha).numpy()
    return render_batch(field, batch).reshape(*shape, 3), photo.reshape(*shape, 3)


def render_views(
    field: RadianceField, capture: Capture, longest: int = LONGEST, across: int = 1
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """`render_view` of all views, one after another."""
    return (render_view(field, capture, view, longest, across) for view in range(len(capture)))
