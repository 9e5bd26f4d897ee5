"""The parts of the vision-language network, untrained."""

import torch

from mitex.features.words.network import WordsNetwork, normalised_contrast, numbered


def test_size():
    network = WordsNetwork()
    assert 1_000_000 < sum(parameter.numel() for parameter in network.parameters()) < 2_000_000


def test_brightness_and_contrast_are_gone():
    images = torch.rand(2, 3, 64, 64, generator=torch.Generator().manual_seed(0))
    normalised = normalised_contrast(images)
    assert torch.allclose(normalised, normalised_contrast(0.6 * images + 0.3), atol=0.15)
    assert abs(normalised.std().item() - 1) < 0.1 and normalised.mean().abs() < 0.05
    assert normalised_contrast(torch.full((1, 3, 64, 64), 0.7)).abs().max() < 1e-4


def test_the_vote_is_the_mean_over_places():
    """In the middle of four equal quarters of a picture, nothing else is seen than in one of them."""
    network = WordsNetwork().eval()
    quarter = torch.rand(1, 3, 64, 64, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        alone, tiled = network.image(quarter), network.image(quarter.repeat(1, 1, 2, 2))
    assert torch.nn.functional.cosine_similarity(alone, tiled) > 0.9


def test_places_of_words_count_and_filling_does_not():
    torch.manual_seed(0)
    text = WordsNetwork().text.eval()
    with torch.no_grad():
        one = text(numbered([["red", "dots", "on", "white"]]))
        other = text(numbered([["white", "dots", "on", "red"]]))
        filled = text(
            numbered([["red", "dots", "on", "white"], ["red", "dots", "on", "white", "and", "blue"]])
        )
    assert torch.allclose(one[0], filled[0], atol=1e-5)
    assert (one - other).norm() > 0.01 * one.norm()
