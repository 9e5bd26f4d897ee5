"""What of a view is background."""

import torch

from mitex.features.coverage import covered_places


def test_what_shows_the_background_is_left_out():
    coverage = torch.ones(8, 8)
    coverage[:3] = 0
    assert covered_places(coverage, (4, 4)).tolist() == list(range(8, 16))
    coverage[7, 7] = 0.5
    assert covered_places(coverage, (4, 4)).tolist() == list(range(8, 15))
    assert covered_places(0 * coverage, (4, 4)).tolist() == list(range(16))
