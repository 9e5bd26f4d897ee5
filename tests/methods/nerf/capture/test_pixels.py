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


def test_a_pixel_has_a_ray_through_each_of_its_parts():
    """At random places when drawn, through the centres in a whole image."""
    photos = capture()
    drawn = Pixels(photos).draw(40, False, torch.Generator().manual_seed(0), across=2)
    image, shape = Pixels(photos).image(1, 5, across=2)
    assert len(drawn.colours) == 10 and len(image.colours) == 10 and shape == (5, 2)
    for batch in (drawn, image):
        for pixel in range(10):
            rays = slice(4 * pixel, 4 * pixel + 4)
            (view,) = set(batch.view[rays].tolist())
            places, _ = photos.project(view, batch.directions[rays].astype(np.float64))
            column, row = np.floor(places[0]).astype(int)
            rgba = photos.images[view][row, column] / np.float32(255)
            np.testing.assert_allclose(torch.cat([batch.colours[pixel], batch.alpha[pixel]]), rgba, rtol=1e-6)
            parts = 2 * (places - [column, row])
            assert np.floor(parts + 1e-4).astype(int).tolist() == [[0, 0], [1, 0], [0, 1], [1, 1]]
            centred = np.allclose(parts % 1, 0.5, atol=1e-4)
            assert centred == (batch is image)


def test_means_of_the_rays_of_each_pixel():
    photos = capture()
    batch, _ = Pixels(photos).image(0, 4, across=3)
    values = np.arange(12 * 9 * 2, dtype=np.float32).reshape(-1, 2)
    expected = [values[9 * k : 9 * k + 9].mean(0) for k in range(12)]
    np.testing.assert_allclose(batch.pixel_mean(values), expected)
    np.testing.assert_allclose(batch.pixel_mean(torch.from_numpy(values)), expected)
    np.testing.assert_allclose(batch.pixel_mean(values[:, 0]), np.array(expected)[:, 0])


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
