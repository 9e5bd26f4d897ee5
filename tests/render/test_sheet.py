"""Contact sheets: who is where."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.render import sheet

COLOURS = np.eye(3, dtype=np.float32)


def plain(colour, height: int = 40, width: int = 40) -> np.ndarray:
    return np.broadcast_to(np.asarray(colour, np.float32), (height, width, 3)).copy()


def test_pictures_stand_in_rows():
    image = sheet([plain(c) for c in COLOURS], columns=2)
    gap = 2
    assert image.shape == (2 * 40 + 3 * gap, 2 * 40 + 3 * gap, 3)
    np.testing.assert_array_equal(image[gap, gap], COLOURS[0])
    np.testing.assert_array_equal(image[gap + 39, gap + 40 + gap], COLOURS[1])
    np.testing.assert_array_equal(image[gap + 40 + gap, gap + 39], COLOURS[2])
    np.testing.assert_array_equal(image[-3, -3], [1, 1, 1])  # the free cell
    np.testing.assert_array_equal(image[0], 1.0)


def test_labels_are_written_below():
    bare, labelled = (sheet([plain(COLOURS[0], 100, 100)], 1, labels=x) for x in (None, ["pebbles"]))
    assert labelled.shape[0] > bare.shape[0]
    assert labelled[104:111].min() < 0.6
    np.testing.assert_array_equal(labelled[3:103, 3:103], bare[3:103, 3:103])


def test_exemplars_get_a_column_of_their_own():
    pictures = [plain(COLOURS[0])] * 4
    one = sheet(pictures, 2, exemplar=plain(COLOURS[1]))
    each = sheet(pictures, 2, exemplar=[plain(COLOURS[1]), plain(COLOURS[2])])
    assert one.shape == each.shape == (86, 130, 3)
    np.testing.assert_array_equal(one[20, 20], COLOURS[1])
    np.testing.assert_array_equal(one[60, 20], [1, 1, 1])
    np.testing.assert_array_equal(each[60, 20], COLOURS[2])
    np.testing.assert_array_equal(each[20, 60], COLOURS[0])


def test_other_shapes_are_scaled_and_centred():
    image = sheet([plain(COLOURS[0], 20, 10)], 1, cell=80)
    assert image.shape == (84, 84, 3)
    np.testing.assert_array_equal(image[42, 42], COLOURS[0])
    np.testing.assert_array_equal(image[42, [12, 72]], 1.0)
    np.testing.assert_array_equal(image[[3, 80], 42], COLOURS[[0, 0]])


def test_wrong_input():
    picture = plain(COLOURS[0])
    for arguments, message in [
        (([], 1), "needs images"),
        (([picture], 0), "needs images"),
        (([picture], 1, ["a", "b"]), "2 labels for 1"),
        (([picture], 1, None, [picture, picture]), "2 exemplars for 1"),
        (([picture[..., 0]], 1), "shape"),
        (([picture[:0]], 1), "shape"),
        (([np.zeros(())], 1), "shape"),
        (([picture], 1, None, None, 0), "cells of 0 pixels"),
        (([picture], 1, None, None, -5), "cells of -5 pixels"),
    ]:
        with pytest.raises(ConfigError, match=message):
            sheet(*arguments)
