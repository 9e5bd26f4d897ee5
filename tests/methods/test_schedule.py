"""The learning rate, and when it falls, reach the training of every method that has them."""

from types import SimpleNamespace

import numpy as np
import pytest

from mitex.cli import main
from mitex.errors import MitexError
from mitex.methods.nca import NcaConfig
from mitex.methods.nerf.config import RadianceConfig
from mitex.methods.registry import methods
from mitex.training.settings import ScheduledConfig
from tests.methods.fits import FITS, prepare, small_coarse_fields
from tests.methods.nca.text.tiny_text import SETTINGS
from tests.methods.nerf.small import small_texture


def methods_with(config):
    """Names of the methods whose settings are of this kind."""
    kinds = {name: next(iter(method.load_presets().values())) for name, method in methods().items()}
    return sorted(name for name, settings in kinds.items() if isinstance(settings, config))


SCHEDULED, RADIANCE = methods_with(ScheduledConfig), methods_with(RadianceConfig)
TEXT = f"--text red --clip words --steps 2 --set {' '.join(SETTINGS)}"
ALONE = {"relief": "start=flat"}  # else `surface` is trained first


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("workplace")
    prepare(folder)
    return folder


def test_methods_are_not_left_out():
    assert {"nca", "surface", "relief", "style_mesh", "text2mesh"} <= set(SCHEDULED)
    assert {"nerf", "plain_field", "nerf_tex"} <= set(RADIANCE)


def test_gradients_of_nca_are_normalised_on_request():
    assert [NcaConfig(normalise_gradients=on).schedule["normalise_gradients"] for on in (True, False)] == [
        True,
        False,
    ]


@pytest.fixture
def trained(workplace, monkeypatch):
    """What gives the options that the loop is called with for the words after `mitex fit METHOD`."""
    options = {}
    small_coarse_fields(monkeypatch, rays=512, table=11, occupancy=32)

    def train(*arguments, **given):
        options.update(given)
        raise MitexError("enough", "this is a test")

    def trained(name, words):
        assert main(f"fit {name} --out out/{name} --quiet {words}".split()) == 2
        return options

    monkeypatch.chdir(workplace)
    monkeypatch.setattr("mitex.training.fit.train", train)
    return trained


@pytest.mark.parametrize("name", [*SCHEDULED, "nca from words"])
def test_they_reach_the_loop(name, trained):
    words = TEXT if name == "nca from words" else f"{FITS[name].fit} {ALONE.get(name, '')}"
    options = trained(name.split()[0], f"{words} lr=0.125 milestones=1 decay=0.75")
    given = {key: options[key] for key in ("lr", "milestones", "decay")}
    assert given == {"lr": 0.125, "milestones": (1,), "decay": 0.75}


@pytest.fixture
def quick_radiance(workplace, monkeypatch):
    """A captured texture, a base shape and a box that nothing has made."""
    texture = small_texture()
    texture.save(workplace / "runs" / "nerf" / "texture.safetensors")
    monkeypatch.setattr("mitex.methods.nerf.fitting.find_base", lambda *_, **__: texture.model.base)
    boxes = "mitex.methods.baselines.nerf_tex.fitting"
    monkeypatch.setattr(f"{boxes}.take_box", lambda *_: SimpleNamespace(half=1.0, light=np.zeros(16)))
    monkeypatch.setattr(f"{boxes}.picture_box", lambda *_: (None, None))
    monkeypatch.setattr(f"{boxes}.possible_cells", lambda *_: None)
    monkeypatch.setattr(f"{boxes}.BoxTask", lambda *_: None)


@pytest.mark.usefixtures("quick_radiance")
@pytest.mark.parametrize("name", RADIANCE)
def test_that_of_radiance_falls_to_a_tenth(name, trained):
    lr = trained(name, f"{FITS[name].fit} lr=0.125 lr_steps=40")["lr"]
    assert [lr(step) for step in (0, 20, 40)] == pytest.approx([0.125, 0.125 / 10**0.5, 0.0125])
