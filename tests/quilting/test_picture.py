"""Patches of a picture."""

import numpy as np

from mitex.quilting.picture import PictureSource

IMAGE = np.random.default_rng(0).random((40, 48, 3), np.float32)


def test_all_patches_of_the_grid():
    source = PictureSource(IMAGE, 16, 8)
    assert len(source.centres) == 4 * 5 and source.length == 16 and source.matched == 3
    for index, (row, column) in enumerate(source.centres - 7.5):
        expected = IMAGE[int(row) :, int(column) :][:16, :16]
        assert np.array_equal(source.patch(index), expected)
    assert source.centres.min(0).tolist() == [7.5, 7.5] and source.centres.max(0).tolist() == [31.5, 39.5]


def test_a_patch_as_large_as_the_picture():
    source = PictureSource(IMAGE[:, :40], 40, 4)
    assert len(source.centres) == 1 and np.array_equal(source.patch(0), IMAGE[:, :40])
