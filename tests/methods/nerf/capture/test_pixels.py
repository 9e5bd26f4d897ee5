"""Pixels of captures, drawn and by image."""

from __future__ import annotations

import numpy as np
import torch

from mitex.mesh import Similarity
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.capture.pixels import Pixels


def capture() -> Capture:
    """Two images of different sizes, whose pixels all differ; cameras that look along -z."""
    images = [
        np.arange(4 * h * w, dtype=np.uint8).reshape(h, w, 4) + 100 * k for k, (h, w) in enumerate(SIZES)
    ]
    return Capture(
        tuple(images),
        np.tile(np.eye(3, 4, dtype=np.float32), (2, 1, 1)),
        np.array([[10, 10, w / 2, h / 2] for h, w in SIZES], np.float32),
        np.zeros((2, 4), np.float32),
        ("0.png", "1.png"),
        Similarity(np.zeros(3), 1.0),
    )


SIZES = (3, 4), (5, 2)


def test_drawn_pixels_are_those_that_their_rays_go_through():
    photos = capture()
    batch = Pixels(photos).draw(200, False, torch.Generator().manual_seed(0))
    assert set(batch.view.tolist()) == {0, 1}
    for k, view in enumerate(batch.view):
        pixels, _ = photos.project(int(view), batch.directions[k : k + 1].astype(np.float64))
        column, row = np.floor(pixels[0]).astype(int)
        rgba = photos.images[view][row, column] / np.float32(255)
        np.testing.assert_allclose(torch.cat([batch.colours[k], batch.alpha[k]]), rgba, rtol=1e-6)


def test_one_view_is_one_view():
    batch = Pixels(capture()).draw(50, True, torch.Generator().manual_seed(0))
    assert len(set(batch.view.tolist())) == 1


def test_an_image_is_thinned_out_without_a_copy_of_all():
    photos = capture()
    pixels = Pixels(photos)
    batch, shape = pixels.image(0, 2)
    assert shape == (2, 2)
    np.testing.assert_allclose(
        batch.colours.reshape(2, 2, 3), photos.images[0][::2, ::2, :3] / np.float32(255)
    )
    assert "_values" not in vars(pixels)
