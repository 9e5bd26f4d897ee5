"""Training from words on a graphics card."""

import pytest
import torch

from mitex.features.text_model import EMBEDDED, text_image_model
from mitex.methods.nca.text.task import TextTask
from tests.methods.nca.text.tiny_text import config
from tests.training.contract import assert_steps_agree


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA graphics card")
def test_a_step_on_the_card_is_that_of_the_processor():
    text = "red dots on white"
    assert_steps_agree(
        *(
            TextTask(config(f"device={device}", text=text), text_image_model(EMBEDDED, device))
            for device in ("cpu", "cuda")
        )
    )
