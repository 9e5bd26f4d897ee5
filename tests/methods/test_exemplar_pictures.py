"""The exemplar beside a view."""

import numpy as np
import pytest

from mitex.methods.exemplar_pictures import LEAST, albedo, framed, side_in_view


def test_a_frame_shows_what_fits_of_the_exemplar(exemplar):
    small, large = framed(exemplar, 16, 24), framed(exemplar, 40, 24)
    assert small.shape == large.shape == (24, 24, 3) and small.dtype == np.float32
    assert np.array_equal(small[:16, :16], albedo(exemplar, 16).numpy())
    assert not small[16:].any() and not small[:, 16:].any()
    assert np.array_equal(large, albedo(exemplar, 40).numpy()[:24, :24])


@pytest.mark.parametrize(
    ("width", "height", "side"), [(0.5, 2.0, 64), (1.0, 2.0, 128), (1e-3, 2.0, LEAST), (100.0, 2.0, 4 * 256)]
)
def test_the_exemplar_is_as_large_as_on_the_mesh_within_bounds(width, height, side):
    assert side_in_view(width, 256, height) == side
