"""Arrays that nobody can change."""

import numpy as np
import pytest
import torch

from mitex.geometry.constant import constant, sealed


def untouchable(values):
    """The same numbers; nothing that is done to what they came from reaches them."""
    array = constant(values, np.float32)
    assert array.dtype == np.float32 and not array.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 9
    return array


def test_what_the_caller_keeps_is_copied():
    own = np.arange(6, dtype=np.float32)
    reader = own[:4]
    reader.flags.writeable = False  # its base still writes
    tensor = torch.arange(6, dtype=torch.float32)
    arrays = [untouchable(values) for values in (own, own[2:], reader, tensor)]
    copies = [array.copy() for array in arrays]
    own += 1
    tensor += 1
    assert all(np.array_equal(array, copy) for array, copy in zip(arrays, copies, strict=True))
    assert own.flags.writeable


def test_what_is_constant_is_shared():
    array = untouchable([1.0, 2.0])
    assert constant(array, np.float32) is array and constant(array[1:], np.float32).base is array
    assert np.array_equal(untouchable(np.array([1, 2])), array)


def test_sealing_copies_nothing():
    array = np.zeros(3)
    assert sealed(array) is array and not array.flags.writeable
