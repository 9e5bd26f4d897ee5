import pytest
import torch

from mitex.evaluation.text import text_scores
from tests.methods.nca.text.tiny_text import MeanColour


def _plain(*rgb):
    return torch.tensor(rgb).expand(2, 16, 16, 3)


def test_a_texture_that_is_what_the_text_says():
    model = MeanColour()
    good = text_scores(model, _plain(1.0, 0.1, 0.1), _plain(0.7, 0.7, 0.7), "a red sphere", "sphere")
    wrong = text_scores(model, _plain(0.1, 1.0, 0.1), _plain(0.7, 0.7, 0.7), "a red sphere", "sphere")
    assert good.direction > 95 and wrong.direction < 10
    assert good.score > 99 > wrong.score > 50  # which tells less


def test_the_formula():
    class Fixed(MeanColour):
        def encode_images(self, images):
            return torch.tensor([[3.0, 4.0], [1.0, 0.0]]) if images.sum() else torch.tensor([[0.0, 2.0]] * 2)

        def encode_texts(self, texts):
            return torch.tensor([[2.0, 0.0], [0.0, 1.0]])

    scores = text_scores(Fixed(), _plain(1.0, 1.0, 1.0), _plain(0.0, 0.0, 0.0), "text", "thing")
    # The mean of (0.6, 0.8) and (1, 0) is (0.8, 0.4); the step from (0, 1) is (0.8, -0.6).
    assert scores.score == pytest.approx(100 * 0.8 / 0.8**0.5)
    assert scores.direction == pytest.approx(100 * 1.4 / 2**0.5)
