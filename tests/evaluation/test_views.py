"""View quality: means of the measures over pairs of pictures."""

import numpy as np
import pytest

from mitex.errors import ImageError
from mitex.evaluation.metrics import ssim, vgg_distance
from mitex.evaluation.views import view_quality


def test_it_is_the_mean_over_views():
    rng = np.random.default_rng(0)
    photos = rng.uniform(0.2, 0.8, (2, 48, 48, 3)).astype(np.float32)
    renderings = photos + np.array([0.1, -0.01], np.float32)[:, None, None, None]
    quality = view_quality(zip(renderings, photos, strict=True))
    assert quality.psnr == pytest.approx(30.0, abs=1e-3)  # of 20 and 40 dB
    for value, measure in ((quality.ssim, ssim), (quality.vgg, vgg_distance)):
        expected = [measure(a, b) for a, b in zip(renderings, photos, strict=True)]
        assert value == pytest.approx(np.mean(expected))


def test_views_of_different_sizes_are_refused():
    with pytest.raises(ImageError):
        view_quality([(np.zeros((16, 16, 3), np.float32), np.zeros((16, 17, 3), np.float32))])
