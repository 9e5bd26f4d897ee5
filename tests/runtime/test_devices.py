"""Which processor torch works on."""

import pytest
import torch

from mitex.errors import ConfigError
from mitex.runtime import available_device, bfloat16_is_fast
from mitex.runtime.precision import VARIABLE


def test_the_processor_is_always_there():
    assert available_device("cpu") == "cpu"


def test_a_card_is_there_or_refused(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert available_device("cuda") == "cuda"
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ConfigError, match="no CUDA graphics card"):
        available_device("cuda")


@pytest.mark.parametrize("cores", [True, False])
def test_bfloat16_on_a_card_depends_on_the_card(monkeypatch, cores):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(torch.cuda, "is_bf16_supported", lambda including_emulation: cores)
    assert bfloat16_is_fast("cuda") is cores
