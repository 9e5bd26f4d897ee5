"""Training on a graphics card."""

import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.methods import geometric
from mitex.methods.geometric import GeometricTexture

SETTINGS = ["fit_steps=5", "fit_samples=200", "level_steps=2", "preview_every=0"]
CARD = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA graphics card")


def test_a_missing_card_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ConfigError, match="no CUDA graphics card here; leave out the device"):
        geometric.fit(icosphere(6), tmp_path / "run", set=[*SETTINGS, "device=cuda"], steps=6)
    assert not (tmp_path / "run").exists()


@CARD
@pytest.mark.parametrize("field", [None, "up"])
def test_the_card_learns_what_the_processor_learns(field, tmp_path):
    """Random numbers come from the CPU, so that devices agree; the card rounds otherwise."""
    grown = []
    for device in ("cpu", "cuda"):
        texture = geometric.fit(
            icosphere(6), tmp_path / device, field=field, set=[*SETTINGS, f"device={device}"], steps=6
        )
        assert texture.fixed.device.type == "cpu"
        texture = GeometricTexture.load(tmp_path / device)
        grown.append(torch.tensor(texture.generate(0).vertices))
    assert (grown[0] - grown[1]).norm() < 1e-2 * grown[0].norm()


@CARD
def test_a_fit_on_the_card_can_go_on_without_it(tmp_path):
    geometric.fit(icosphere(6), tmp_path, set=[*SETTINGS, "device=cuda"], steps=3)
    texture = geometric.fit(icosphere(6), tmp_path, set=[*SETTINGS, "device=cpu"], steps=6, resume=True)
    assert texture.levels == 3
