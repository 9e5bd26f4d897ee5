import math

import pytest
import torch

from mitex.losses import directional_distance, mean_direction, text_distance
from mitex.losses.text import SHORT


def _vectors(count, seed=0):
    return torch.randn(count, 8, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def _slow(pictures, negatives, text, negative_text):
    """The formula, number by number."""

    def unit(v):
        length = math.sqrt(sum(x * x for x in v))
        return [x / length for x in v]

    def mean(rows):
        rows = [unit(row) for row in rows]
        return [sum(column) / len(rows) for column in zip(*rows, strict=True)]

    step = [a - b for a, b in zip(mean(pictures), mean(negatives), strict=True)]
    aim = unit([a - b for a, b in zip(unit(text), unit(negative_text), strict=True)])
    length = math.sqrt(sum(x * x for x in step) + SHORT**2)
    return 1 - sum(a * b for a, b in zip(step, aim, strict=True)) / length


def test_the_formula():
    pictures, negatives, (text, negative) = _vectors(3), _vectors(3, 1), _vectors(2, 2)
    actual = directional_distance(mean_direction(pictures), mean_direction(negatives), text, negative)
    expected = _slow(pictures.tolist(), negatives.tolist(), text.tolist(), negative.tolist())
    assert actual.item() == pytest.approx(expected, abs=1e-12)


def test_it_is_zero_along_the_text_and_two_against_it():
    text, negative, start = _vectors(3)
    aim = torch.nn.functional.normalize(text, dim=0) - torch.nn.functional.normalize(negative, dim=0)
    for sign, distance in ((1, 0.0), (-1, 2.0)):
        actual = directional_distance(start + sign * aim, start, text, negative)
        assert actual.item() == pytest.approx(distance, abs=1e-3)


def test_lengths_of_embeddings_do_not_matter():
    pictures, negatives, (text, negative) = _vectors(3), _vectors(3, 1), _vectors(2, 2)
    expected = directional_distance(mean_direction(pictures), mean_direction(negatives), text, negative)
    factors = torch.tensor([[2.0], [0.5], [7.0]])
    scaled = mean_direction(factors * pictures), mean_direction(3 * negatives), 5 * text, 0.1 * negative
    assert torch.allclose(directional_distance(*scaled), expected)


def test_without_a_direction_it_is_one_and_leads_to_the_text():
    text, negative, start = _vectors(3)
    pictures = start.clone().requires_grad_()
    loss = directional_distance(pictures, start, text, negative)
    (gradient,) = torch.autograd.grad(loss, pictures)
    assert loss.item() == 1.0
    assert gradient.norm().item() == pytest.approx(1 / SHORT)
    after = directional_distance(pictures - 1e-4 * gradient, start, text, negative)
    assert after.item() < 1


def test_its_gradient():
    negatives, (text, negative) = _vectors(2, 1), _vectors(2, 2)
    assert torch.autograd.gradcheck(
        lambda pictures: directional_distance(
            mean_direction(pictures), mean_direction(negatives), text, negative
        ),
        _vectors(2).requires_grad_(),
    )


def test_the_plain_distance_is_one_less_the_mean_cosine():
    """Of each picture, whatever the lengths."""
    text, across = torch.tensor([2.0, 0, 0]), torch.tensor([0, 3.0, 0])
    groups = [[5 * text], [across], [text + across], [-text], [text, -3 * text], [text, across]]
    values = [text_distance(mean_direction(torch.stack(group)), text).item() for group in groups]
    assert values == pytest.approx([0, 1, 1 - 2 / math.sqrt(13), 2, 1, 0.5], abs=1e-6)
