"""Resolving configs from presets, files and settings."""

import json
from dataclasses import dataclass, fields, replace
from typing import Literal

import pytest

from mitex.errors import ConfigError
from mitex.training.config import resolve
from mitex.training.settings import TrainingConfig, bounds, key, meaning, table
from mitex.training.toml import to_toml


@dataclass(frozen=True)
class Config(TrainingConfig):
    preset: str = "patch"
    steps: int = 100
    lr: float = key(1e-3, "learning rate", 0, 1)
    pooling: Literal["max", "average"] = key("max", "of the network")
    cull: bool = key(False, "leave out back faces")
    layers: tuple[str, ...] = key(("relu1_1", "relu2_1"), "of the network")
    milestones: tuple[int, ...] = key((50, 75), "steps")
    size: tuple[int, int] = key((96, 96), "height and width [px]", 8)
    init: str | None = key(None, "a model")
    cap: int | None = key(5, "the most", None, 10)
    pace: float | Literal["auto"] = key("auto", "speed")

    def __post_init__(self):
        super().__post_init__()
        if self.milestones and self.milestones[-1] > self.steps:
            raise ConfigError("milestones lie beyond steps", "raise steps")


PRESETS = {"patch": Config(), "paper": Config(steps=900, preset="paper", lr=0.5)}


def _error(*overrides, file=None, preset=None):
    with pytest.raises(ConfigError) as error:
        resolve(PRESETS, preset, file, overrides)
    return str(error.value)


def test_the_first_preset_is_the_default():
    assert resolve(PRESETS) == Config()


def test_order_preset_file_override(tmp_path):
    file = tmp_path / "c.toml"
    file.write_text("seed = 4\nlr = 0.25\n")
    config = resolve(PRESETS, "paper", file, ["lr=0.125"])
    assert config == Config(steps=900, seed=4, preset="paper", lr=0.125)


@pytest.mark.parametrize(
    ("setting", "key", "value"),
    [
        ("steps=1_000", "steps", 1000),
        (" seed = 3 ", "seed", 3),
        ("lr=1", "lr", 1.0),
        ("lr=2.5e-1", "lr", 0.25),
        ("pooling=average", "pooling", "average"),
        ("cull=yes", "cull", True),
        ("cull=TRUE", "cull", True),
        ("cull=0", "cull", False),
        ("layers=relu3_1", "layers", ("relu3_1",)),
        ("layers=a, b ,", "layers", ("a", "b")),
        ("layers=['a', \"b\"]", "layers", ("a", "b")),
        ("layers=", "layers", ()),
        ("milestones=[]", "milestones", ()),
        ("milestones=1,2,3", "milestones", (1, 2, 3)),
        ("size=(8, 16)", "size", (8, 16)),
        ("init=a=b.safetensors", "init", "a=b.safetensors"),
        ("init=none", "init", None),
        ("cap=None", "cap", None),
        ("cap=7", "cap", 7),
        ("pace=auto", "pace", "auto"),
        ("pace=2", "pace", 2.0),
    ],
)
def test_settings_reach_every_type(setting, key, value):
    result = getattr(resolve(PRESETS, overrides=[setting]), key)
    assert result == value
    assert type(result) is type(value)


def test_settings_are_checked_together_and_the_last_one_counts():
    assert resolve(PRESETS, overrides=["steps=10", "milestones=5", "steps=20"]).steps == 20


@pytest.mark.parametrize(
    "setting",
    [
        "steps=1.5",
        "steps=many",
        "steps=",
        "steps=none",
        "lr=nan",
        "lr=-inf",
        "lr=1e999",
        "cull=maybe",
        "pooling=min",
        "milestones=1,,2",
        "milestones=1.5",
        "size=8",
        "size=8,8,8",
        "cap=x",
        "pace=slow",
        "pace=nan",
    ],
)
def test_wrong_values_name_key_value_and_what_is_wanted(setting):
    key, _, text = setting.partition("=")
    message = _error(setting)
    assert message.startswith(f"{key} cannot be {text!r}; give ")


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("stepps=3", "there is no key 'stepps'; did you mean steps?"),
        ("zzz=3", "there is no key 'zzz'; use one of preset, seed, steps, checkpoint_every"),
        ("steps", "'steps' is not a setting; write key=value"),
        ("=3", "'=3' is not a setting; write key=value"),
        ("preset=papr", "there is no preset 'papr'; did you mean paper?"),
        ("steps=0", "steps = 0 is out of range; choose 1 or more"),
        ("lr=2", "lr = 2 is out of range; choose from 0 to 1"),
        ("cap=11", "cap = 11 is out of range; choose 10 or less"),
        ("size=96,4", "size = 4 is out of range; choose 8 or more"),
        ("steps=60", "milestones lie beyond steps; raise steps"),
        ("size=a", "size cannot be 'a'; give a list of 2: a whole number, a whole number"),
        ("layers2=a", "there is no key 'layers2'; did you mean layers?"),
        ("pace=x", "pace cannot be 'x'; give a finite number or one of 'auto'"),
    ],
)
def test_messages(setting, message):
    assert _error(setting).startswith(message)


def test_toml_values_of_every_type(tmp_path):
    file = tmp_path / "c.toml"
    file.write_text(
        'lr = 1\ncull = true\nlayers = ["x"]\nmilestones = []\ninit = "m"\ncap = "none"\npace = 3\n'
        '[versions]\na = "1"\n'
    )
    config = resolve(PRESETS, file=file)
    assert config == Config(lr=1.0, cull=True, layers=("x",), milestones=(), init="m", cap=None, pace=3.0)
    assert type(config.lr) is float
    assert type(config.pace) is float


@pytest.mark.parametrize(
    "content",
    [
        "steps = true",
        "steps = 1.0",
        'steps = "5"',
        "steps = [5]",
        "lr = nan",
        "lr = inf",
        "lr = 1" + 400 * "0",
        "lr = true",
        "cull = 1",
        'cull = "true"',
        'layers = "relu1_1"',
        "layers = [1]",
        "milestones = [1.0]",
        "size = [8]",
        "init = 3",
        "pooling = 3",
        "steps = 1979-05-27",
        "[steps]\na = 1",
        "[other]\na = 1",
        "step = 3",
        "steps = ",
        "steps = 1\nsteps = 2",
        "a = " + "[" * 5000,
    ],
)
def test_bad_files(tmp_path, content):
    file = tmp_path / "c.toml"
    file.write_text(content)
    assert "; " in _error(file=file)  # what is wrong; what to do


def test_unreadable_files(tmp_path):
    binary = tmp_path / "b.toml"
    binary.write_bytes(b"steps = \xff\xfe")
    assert "not valid TOML" in _error(file=binary)
    assert "cannot be read" in _error(file=tmp_path / "missing.toml")
    assert "cannot be read" in _error(file=tmp_path)
    assert "cannot be read" in _error(file="a\0b")


def test_where_the_preset_comes_from(tmp_path):
    file = tmp_path / "c.toml"
    file.write_text('preset = "paper"\n')
    assert resolve(PRESETS, file=file).lr == 0.5
    assert resolve(PRESETS, "paper", file).lr == 0.5
    assert resolve(PRESETS, overrides=["preset=paper"]).lr == 0.5
    assert resolve(PRESETS, "paper", file, ["preset=paper"]).lr == 0.5
    for preset, override in (("patch", []), (None, ["preset=patch"]), ("patch", ["preset=paper"])):
        error = _error(*override, file=file, preset=preset)
        assert "preset 'patch'" in error and "preset 'paper'" in error and "contradicts" in error
    assert _error("preset=paper", preset="patch").startswith("preset 'patch' contradicts preset 'paper' in ")
    assert "there is no preset 'x'" in _error(preset="x")


def test_a_resolved_config_reads_back(tmp_path):
    config = replace(
        PRESETS["paper"], layers=("a,b", "none"), init='a "quoted" \\ näme', cap=None, lr=0.1 + 0.2
    )
    file = tmp_path / "config.toml"
    file.write_text(to_toml(config, {"run": {"method": "nca"}, "versions": {"torch": "2"}}), encoding="utf-8")
    assert resolve(PRESETS, file=file) == config
    assert json.dumps(resolve(PRESETS, file=file).lr) == "0.30000000000000004"


class TestKeys:
    def test_a_class_that_gives_another_default_inherits_meaning_and_range(self):
        steps = {one.name: one for one in fields(Config)}["steps"]
        assert Config().steps == 100
        assert (meaning(Config, steps), bounds(Config, steps)) == ("training steps", (1, None))

    def test_a_key_without_a_meaning_is_a_mistake_in_the_class(self):
        @dataclass(frozen=True)
        class Bare(TrainingConfig):
            width: int = 3

        with pytest.raises(TypeError, match="Bare.width is not declared"):
            Bare()

    def test_choices_are_checked_however_a_config_is_made(self):
        with pytest.raises(ConfigError, match="pooling = 'min' is unknown; give one of 'max', 'average'"):
            replace(Config(), pooling="min")

    def test_the_table_tells_value_range_and_meaning_of_every_key(self):
        lines = table(replace(Config(), lr=0.25)).splitlines()
        assert [line.split(" = ")[0] for line in lines] == [one.name for one in fields(Config)]
        rows = dict(line.split(" = ", 1) for line in lines)
        assert rows["lr"].split() == ["0.25", "learning", "rate", "(from", "0", "to", "1)"]
        assert rows["pooling"].split() == ["max", "of", "the", "network", "(max,", "average)"]
        assert rows["milestones"].split() == ["50,75", "steps"]
        assert rows["cap"].endswith("the most (10 or less)")
        assert rows["init"].startswith("none ")


def test_numbers_are_shown_with_six_digits_at_most():
    rows = table(replace(PRESETS["patch"], lr=0.1 + 0.2, pace=2 / 3)).splitlines()
    settings = {row.split(" = ")[0]: row.split(" = ")[1].split()[0] for row in rows}
    assert (settings["lr"], settings["pace"]) == ("0.3", "0.666667")
    assert _error("lr=1.2000000000000002").startswith("lr = 1.2 is out of range")
