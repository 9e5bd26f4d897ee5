"""Presets as published, and values that are refused."""

from dataclasses import asdict, fields

import pytest

from mitex.errors import ConfigError
from mitex.features.flow.lucas_kanade import LEAST_SIDE as MEASURABLE
from mitex.methods.nca import PRESETS
from mitex.methods.nca.config import DECODER_KEYS, LEAST_SIDE
from mitex.methods.nca.decoder.shape import DecoderShape
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
    "aggregation": "sum",
    "surfaces": ("even",),
    "relief_weight": 0.0,
    "zooms": 1,
    "decoder": False,
    "interpolation": "linear",
    "order_weight": 0.0,
    "moment_weight": 0.1,
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
    presets = ["patch", "paper", "motion", "motion-paper", "text", "text-words", "text-paper"]
    assert list(PRESETS) == presets
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
        ("layers=relu1_1", "order_weight needs patches and the layer relu3_1"),
        ("views=full", "full views need spheres, and surfaces holds 'flat'; use even or uneven"),
        ("order_weight=-1", "order_weight = -1"),
        ("surfaces=round", r"surfaces holds \['round'\]; use one or more of even, uneven, flat"),
        ("surfaces=", "surfaces holds nothing"),
        ("relief_weight=-1", "relief_weight = -1"),
        ("aggregation=max", "aggregation cannot be 'max'"),
        ("zooms=0", "zooms = 0"),
        ("zooms=7", "zooms = 7"),
        ("interpolation=cubic", "interpolation cannot be 'cubic'"),
        ("coordinates=waves,spirals", r"coordinates holds \['spirals'\]; use some of waves, barycentrics"),
        ("waves=0", "waves = 0"),
        ("wave_frequencies=", "wave_frequencies holds nothing"),
        ("text_distances=", "text_distances holds nothing; give one or more"),
        ("text_distances=2,1", "text_distances = 1"),
        ("wave_frequencies=2,-1", "wave_frequencies = -1"),
        ("wave_amplitude=-0.1", "wave_amplitude = -0.1"),
        ("decoder_width=0", "decoder_width = 0"),
        ("decoder_width=1025", "decoder_width = 1025"),
        ("decoder_depth=0", "decoder_depth = 0"),
        ("omega=-1", "omega = -1"),
        ("decoder=perhaps", "decoder"),
        ("checkpoint_every=0", "checkpoint_every = 0"),
        ("blend=perhaps", "blend"),
        ("motion_speeds=1", r"motion_speeds holds \(1.0,\); give the least, and the most above 0"),
        ("motion_speeds=2,1", r"motion_speeds holds \(2.0, 1.0\)"),
        ("motion_speeds=0,0", r"motion_speeds holds \(0.0, 0.0\); give the least, and the most above 0"),
        ("motion_speeds=-1,1", "motion_speeds = -1"),
        ("motion_period=0", "motion_period = 0"),
        ("motion_steps=0", "motion_steps = 0"),
        ("motion_weight=-1", "motion_weight = -1"),
        ("motion=up motion_start=900", "motion_start = 900 comes after the last of 900 steps; choose less"),
        (
            "motion=up motion_estimator=lucas-kanade resolution=31",
            "lucas-kanade .* resolution = 31; choose 32",
        ),
        ("motion_estimator=raft", "motion_estimator cannot be 'raft'"),
        ("resolutoin=64", "resolutoin"),
    ],
)
def test_values_out_of_range(setting, problem):
    with pytest.raises(ConfigError, match=problem):
        resolve(PRESETS, overrides=setting.split(" "))


@pytest.mark.parametrize("words", ["", "waves", "polynomials,barycentrics"])
def test_coordinates_may_be_any_or_none(words):
    names = tuple(name for name in words.split(",") if name)
    shape = resolve(PRESETS, overrides=[f"coordinates={words}"]).decoder_shape
    assert shape.coordinates == names


def test_the_default_decoder_is_the_default_shape():
    """Of a look that is built without settings."""
    assert resolve(PRESETS).decoder_shape == DecoderShape()


def test_every_key_of_the_decoder_shapes_it():
    """And nothing else does."""
    values = {"interpolation": "linear", "coordinates": "polynomials", "waves": 3, "wave_frequencies": 1.5}
    values |= {"wave_amplitude": 0.1, "decoder_width": 9, "decoder_depth": 2, "omega": 4.0}
    assert values.keys() == DECODER_KEYS.keys()
    assert set(DECODER_KEYS.values()) == {field.name for field in fields(DecoderShape)}
    plain = asdict(DecoderShape())
    for key, value in values.items():
        shape = asdict(resolve(PRESETS, overrides=[f"{key}={value}"]).decoder_shape)
        assert [part for part in shape if shape[part] != plain[part]] == [DECODER_KEYS[key]]


MOTION_PAPER = {
    **PAPER,
    "channels": 32,
    "min_steps": 32,
    "max_steps": 64,
    "resolution": 128,
    "distance": 2.0,
    "motion_encoding": True,
    "motion_estimator": "flow",
    "motion_weight": 0.67,
    "motion_gamma": 1.5,
    "motion_period": 24.0,
    "motion_turns": False,
    "motion_speeds": (1.0, 1.0),
}


@pytest.mark.parametrize("key", MOTION_PAPER)
def test_the_published_motion(key):
    """Tables 2 and 3, and what is not said there as in the still training."""
    assert getattr(PRESETS["motion-paper"], key) == MOTION_PAPER[key]
    assert PRESETS["motion-paper"].motion_steps >= 64  # all steps of a rollout


def test_moving_looks_are_of_the_shape_of_still_ones():
    """So that bundled models can be their parents."""
    shape = ("channels", "hidden", "degree", "aggregation", "decoder", *DECODER_KEYS)
    assert all(getattr(PRESETS["patch"], key) == getattr(PRESETS["motion"], key) for key in shape)
    assert PRESETS["motion"].motion and not PRESETS["patch"].motion and not PRESETS["paper"].motion


def test_what_the_settings_of_motion_need_is_asked_of_motion_alone():
    """And no step at all is no schedule."""
    for words in (
        "motion=up motion_start=899",
        "motion_start=900",
        "motion=up steps=0",
        "motion=up motion_estimator=lucas-kanade resolution=32",
        "motion_estimator=lucas-kanade resolution=16",
    ):
        resolve(PRESETS, overrides=words.split())
    assert LEAST_SIDE == MEASURABLE


def test_equal_steps_are_a_range():
    assert resolve(PRESETS, overrides=["min_steps=7", "max_steps=7"]).max_steps == 7
