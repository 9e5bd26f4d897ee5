"""Presets as published, and values that are refused."""

import pytest

from mitex.errors import ConfigError
from mitex.methods.nca import PRESETS
from mitex.training import resolve

PAPER = {
    "channels": 16,
    "hidden": 128,
    "degree": 1,
    "gain": 1.2,
    "frequency": 64,
    "pool": 256,
    "inject_every": 16,
    "min_steps": 15,
    "max_steps": 24,
    "views": "full",
    "view_count": 6,
    "resolution": 320,
    "distance": 2.5,
    "fov": 60.0,
    "exemplar_size": 128,
    "target_size": 224,
    "blend": False,
    "pooling": "average",
    "samples": 1024,
    "colour_weight": 1.0,
    "colour_histogram": False,
    "overflow_weight": 1e4,
    "appearance_weight": 2.0,
    "steps": 4000,
    "lr": 1e-3,
    "milestones": (1000, 2000),
    "decay": 0.3,
    "normalise_gradients": True,
}


@pytest.mark.parametrize("key", PAPER)
def test_paper_preset(key):
    assert getattr(PRESETS["paper"], key) == PAPER[key]


def test_layers_of_the_authors():
    """ReLUs 1, 3, 6, 8, 11, 13, 15, 22 and 29 of torchvision's list."""
    layers = "relu1_1 relu1_2 relu2_1 relu2_2 relu3_1 relu3_2 relu3_3 relu4_3 relu5_3"
    assert PRESETS["paper"].layers == tuple(layers.split())


def test_names_and_default():
    assert list(PRESETS) == ["patch", "paper"]
    assert all(config.preset == name for name, config in PRESETS.items())
    assert resolve(PRESETS).preset == "patch"


@pytest.mark.parametrize(
    ("setting", "problem"),
    [
        ("steps=-1", "steps = -1"),
        ("channels=11", "channels = 11"),
        ("hidden=0", "hidden = 0"),
        ("degree=3", "degree = 3"),
        ("frequency=0", "frequency = 0"),
        ("pool=0", "pool = 0"),
        ("inject_every=0", "inject_every = 0"),
        ("min_steps=0", "min_steps = 0"),
        ("max_steps=19", "max_steps = 19"),
        ("view_count=0", "view_count = 0"),
        ("resolution=15", "resolution = 15"),
        ("distance=1", "distance = 1"),
        ("fov=0", "fov = 0"),
        ("density=3", "density = 3"),
        ("exemplar_size=8", "exemplar_size = 8"),
        ("target_size=4096", "target_size = 4096"),
        ("samples=0", "samples = 0"),
        ("moment_weight=-0.1", "moment_weight = -0.1"),
        ("colour_weight=-1", "colour_weight = -1"),
        ("lr=-1e-3", "lr = -0.001"),
        ("lr=nan", "lr"),
        ("views=fisheye", "views cannot be 'fisheye'; give one of 'patch', 'full'"),
        ("pooling=mean", "pooling cannot be 'mean'"),
        ("layers=relu1_1,relu6_1", "relu6_1"),
        ("layers=", "layers"),
        ("checkpoint_every=0", "checkpoint_every = 0"),
        ("blend=perhaps", "blend"),
        ("resolutoin=64", "resolutoin"),
    ],
)
def test_values_out_of_range(setting, problem):
    with pytest.raises(ConfigError, match=problem):
        resolve(PRESETS, overrides=[setting])


def test_equal_steps_are_a_range():
    assert resolve(PRESETS, overrides=["min_steps=7", "max_steps=7"]).max_steps == 7
