"""Pictures moved along a motion, and normalised."""

import pytest
import torch

from mitex.features.flow.warping import doubled, halved, normalised_contrast, warp


def test_a_ramp_stays_a_ramp():
    """Interpolation that bends a ramp would make every motion wrong by a part of a pixel."""
    y, x = torch.meshgrid(torch.arange(10.0), torch.arange(12.0), indexing="ij")
    motion = torch.rand(1, 2, 10, 12, generator=torch.Generator().manual_seed(0)) * 2 - 1
    warped = warp((3 * x - 2 * y)[None, None], motion)
    expected = 3 * (x + motion[:, 0]) - 2 * (y + motion[:, 1])
    assert torch.allclose(warped[0, :, 3:-3, 3:-3], expected[:, 3:-3, 3:-3], atol=1e-5)


def test_whole_pixels_are_copied_and_the_border_goes_on():
    image = torch.rand(2, 3, 9, 8, generator=torch.Generator().manual_seed(0))
    right = torch.tensor([2.0, -1.0])[:, None, None].expand(2, 2, 9, 8)
    assert torch.allclose(warp(image, right)[:, :, 1:, :6], image[:, :, :-1, 2:], atol=1e-5)
    assert torch.allclose(warp(image, 100 * right), image[:, :, :1, -1:].expand_as(image), atol=1e-5)


def test_gradients_of_the_warp():
    generator = torch.Generator().manual_seed(0)
    inputs = [torch.rand(1, c, 6, 7, generator=generator).double() * 0.3 + 0.1 for c in (1, 2)]
    steps = [torch.randn(x.shape, generator=generator).double() for x in inputs]
    weight = torch.randn(1, 1, 6, 7, generator=generator).double()
    leaves = [x.clone().requires_grad_() for x in inputs]
    gradients = torch.autograd.grad((warp(leaves[0], leaves[1]) * weight).sum(), leaves)
    for moving in ((1, 0), (0, 1)):  # the image, the motion
        ends = []
        for side in (1e-6, -1e-6):
            values = [x + side * on * step for x, on, step in zip(inputs, moving, steps, strict=True)]
            ends.append((warp(values[0], values[1]) * weight).sum())
        slope = sum(on * (g * step).sum() for g, on, step in zip(gradients, moving, steps, strict=True))
        assert float(slope) == pytest.approx(float(ends[0] - ends[1]) / 2e-6, rel=1e-4)


@pytest.mark.parametrize("side", [16, 17])
def test_from_a_coarse_level_to_a_fine_one(side):
    """The middle of a coarse pixel is that of its four fine ones."""
    ramp = (torch.arange(float(side)) + 0.5).expand(1, 1, side, side)
    coarse = halved(ramp)
    assert torch.allclose(coarse[..., : side // 2], 2 * torch.arange(side // 2) + 1.0)
    motion = (coarse / 2).expand(1, 2, -1, -1)  # in coarse pixels
    inside = slice(1, 2 * (side // 2) - 1)
    assert torch.allclose(doubled(motion, side, side)[..., inside], ramp.expand(1, 2, -1, -1)[..., inside])


def test_brightness_and_contrast_are_gone():
    image = torch.rand(1, 2, 40, 50, generator=torch.Generator().manual_seed(0))
    normalised = normalised_contrast(image)
    assert torch.allclose(normalised, normalised_contrast(0.5 * image + 0.4), atol=0.02)
    assert normalised.mean().abs() < 0.02 and abs(normalised.std() - 1) < 0.1
    assert normalised_contrast(torch.full((1, 1, 40, 40), 0.7)).abs().max() < 1e-3
