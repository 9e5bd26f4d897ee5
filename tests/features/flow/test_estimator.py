"""The estimators of the settings measure a motion of a pixel and a half."""

import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.features.flow import load_estimator


@pytest.fixture(scope="module")
def pictures():
    """Grey, moved to the right by a pixel and a half and up by one: means of two neighbours in both."""
    grey = torch.from_numpy(Exemplar.load("lava").resized(128).maps["albedo"]).mean(2)
    smooth = torch.nn.functional.avg_pool2d(grey[None, None], 3, stride=1, padding=1)[0, 0]
    ends = smooth.roll((0, 1), (0, 1)), smooth.roll((-2, 2), (0, 1))
    return smooth.roll((0, 0), (0, 1))[None, None], ((ends[0] + ends[1]) / 2)[None, None]


@pytest.mark.parametrize("name", ["lucas-kanade", "flow"])
def test_estimators_of_pictures(pictures, name):
    estimator = load_estimator(name)
    second = pictures[1].clone().requires_grad_()
    motion = estimator(pictures[0], second)
    assert motion.shape == (1, 2, 128, 128)
    middle = motion[0, :, 16:-16, 16:-16].median(2).values.median(1).values
    assert middle.tolist() == pytest.approx([1.5, -1.0], abs=0.35)
    motion.sum().backward()
    assert second.grad is not None and second.grad.any()
