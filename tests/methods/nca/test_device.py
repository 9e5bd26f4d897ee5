"""Training on a graphics card."""

import pytest
import torch

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.methods import nca
from mitex.methods.nca.task import NcaTask
from tests.methods.nca.tiny import SETTINGS, config
from tests.training.contract import assert_steps_agree


@pytest.fixture(scope="module")
def exemplar():
    maps = Exemplar.load("scales").maps
    return Exemplar({name: maps[name] for name in ("albedo", "height", "normal")}, "scales")


def test_a_missing_card_is_refused(exemplar, monkeypatch, tmp_path):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ConfigError, match="no CUDA graphics card here; leave out the device"):
        nca.fit(exemplar, tmp_path / "run", set=[*SETTINGS, "device=cuda"])
    assert not (tmp_path / "run").exists()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA graphics card")
@pytest.mark.parametrize("surfaces", ["even", "flat"])
def test_a_step_on_the_card_is_that_of_the_processor(exemplar, surfaces):
    settings = (f"surfaces={surfaces}", "relief_weight=1", "order_weight=0")
    tasks = [NcaTask(config(*settings, f"device={device}"), exemplar) for device in ("cpu", "cuda")]
    assert_steps_agree(*tasks)
    assert [task.pool.device.type for task in tasks] == ["cpu", "cuda"]


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA graphics card")
def test_a_fit_on_the_card_can_go_on_without_it(exemplar, tmp_path):
    out = tmp_path / "run"
    nca.fit(exemplar, out, set=[*SETTINGS, "device=cuda"], steps=2)
    texture = nca.fit(exemplar, out, set=[*SETTINGS, "device=cpu"], steps=4, resume=True)
    assert texture.about["steps"] == 4 and texture.look.device.type == "cpu"
