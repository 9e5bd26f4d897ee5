import numpy as np
import torch

from mitex.scenes.cameras import orbit
from mitex.scenes.shaded import AMBIENT, lamps, shading


def _along(cosines):
    normals = torch.stack([cosines, (1 - cosines**2).sqrt(), torch.zeros_like(cosines)], 1)
    return shading(normals, torch.tensor([[1.0, 0.0, 0.0]]).expand(len(normals), -1))[:, 0]


def test_a_lamp_s_light_is_that_of_a_cosine_but_for_its_edge():
    cosines = torch.linspace(-1, 1, 201)
    light = (_along(cosines) - AMBIENT) / (1 - AMBIENT)
    assert (light - cosines.clamp(min=0)).abs().max() < 0.1
    assert light[-1] == 1.0 and light.min() > -0.04


def test_the_series_is_the_best_of_its_degree():
    """What it leaves out of a cosine has no part in harmonics up to the second degree."""
    x = torch.linspace(-1, 1, 20_001, dtype=torch.float64)
    rest = x.clamp(min=0) - (_along(x) - AMBIENT) / (1 - AMBIENT) * (0.25 + 0.5 + 5 / 16)
    for polynomial in (torch.ones_like(x), x, 3 * x * x - 1):
        assert (rest * polynomial).mean().abs() < 1e-4


def test_lamps_are_beside_their_cameras():
    cameras = orbit(3, elevation=20)
    right, up, forward = cameras.axes()
    directions = lamps(cameras).numpy()
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    for axis, sign in ((right, -1), (up, 1), (forward, -1)):
        assert ((directions * axis).sum(1) * sign > 0.3).all()
