"""Training from words on a graphics card."""

import pytest
import torch

from mitex.features.text_model import EMBEDDED, text_image_model
from mitex.methods.nca.text.task import TextTask
from tests.methods.nca.text.tiny_text import config


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA graphics card")
def test_a_step_on_the_card_is_that_of_the_processor():
    """Random numbers come from the CPU, so that devices agree; the card rounds otherwise."""
    losses, gradients = [], []
    for device in ("cpu", "cuda"):
        task = TextTask(
            config(f"device={device}", text="red dots on white"), text_image_model(EMBEDDED, device)
        )
        step = task.loss(1, torch.Generator().manual_seed(0))
        step.value.backward()
        step.commit()
        losses.append(step.value.item())
        gradients.append(torch.cat([p.grad.flatten().cpu() for p in task.parameters if p.grad is not None]))
    assert losses[1] == pytest.approx(losses[0], rel=1e-2)
    assert torch.cosine_similarity(*gradients, dim=0) > 0.99
