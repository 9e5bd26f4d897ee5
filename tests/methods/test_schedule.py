"""The learning rate, and when it falls, reach the training of every method that has them."""

import pytest

from mitex.cli import main
from mitex.errors import MitexError
from mitex.methods.nca import NcaConfig
from mitex.methods.registry import methods
from mitex.training.settings import ScheduledConfig
from tests.methods.fits import FITS, prepare

SCHEDULED = sorted(
    name
    for name, method in methods().items()
    if isinstance(next(iter(method.load_presets().values())), ScheduledConfig)
)
ALONE = {"relief": "start=flat"}  # else `surface` is trained first


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("workplace")
    prepare(folder)
    return folder


def test_methods_are_not_left_out():
    assert {"nca", "surface", "relief", "style_mesh", "text2mesh"} <= set(SCHEDULED)


def test_gradients_of_nca_are_normalised_on_request():
    assert [NcaConfig(normalise_gradients=on).schedule["normalise_gradients"] for on in (True, False)] == [
        True,
        False,
    ]


@pytest.mark.parametrize("name", SCHEDULED)
def test_they_reach_the_loop(name, workplace, monkeypatch):
    options = {}

    def train(*arguments, **given):
        options.update(given)
        raise MitexError("enough", "this is a test")

    monkeypatch.chdir(workplace)
    monkeypatch.setattr("mitex.training.fit.train", train)
    words = f"fit {name} --out out/{name} --quiet {FITS[name].fit} {ALONE.get(name, '')}"
    words += " lr=0.125 milestones=1 decay=0.75"
    assert main(words.split()) == 2
    given = {key: options[key] for key in ("lr", "milestones", "decay")}
    assert given == {"lr": 0.125, "milestones": (1,), "decay": 0.75}
