"""Every setting of `SurfaceConfig` changes the texture: an ignored one fails here."""

from dataclasses import fields
from functools import cache

import numpy as np
import pytest

from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods import surface
from mitex.runtime import threads

pytestmark = pytest.mark.usefixtures("own_cache", "known_exemplars")
BASE = {
    **{"resolution": "48", "exemplar_size": "48", "steps": "3", "scales": "0", "layers": "relu1_1,relu2_1"},
    **{"checkpoint_every": "9", "preview_every": "0", "start": "noise"},
}
MESH = icosphere(6)
UNCHANGED = {"preset", "checkpoint_every", "preview_every"}  # what they do is tested with the loop
PATCHES = {"start": "patches"}  # the default, which takes a while
TRANSPORT, CONTENT = {"loss": "transport", "samples": "64"}, {"content": "ao", "whitened": "false"}
# key -> another value, and what else both fits are given
CASES: dict[str, tuple[str, dict[str, str]]] = {
    "steps": ("4", {}),
    "seed": ("1", PATCHES),
    "resolution": ("40", {}),
    "scale": ("0.5", {}),
    "exemplar_size": ("32", {}),
    "frames": ("fixed", {}),
    "angle": ("90", {}),
    "correct": ("false", {"layers": "relu2_1,relu3_1"}),
    "continued": ("false", {}),
    "bilinear": ("false", {}),
    "weights": ("random", {}),
    "pooling": ("max", {}),
    "loss": ("transport", {}),
    "samples": ("32", TRANSPORT),
    "moment_weight": ("5", TRANSPORT),
    "region": ("0", {"region": "0.4", "layers": "relu1_1", "resolution": "96"}),
    "colours": ("0", {}),
    "layers": ("relu1_1,pool2", {}),
    "content_layer": ("relu2_1", CONTENT),
    "content_weight": ("0", CONTENT),
    "scales": ("1", {}),
    "coarse_share": ("0.9", {"scales": "1"}),
    "triples": ("3", {"maps": "all"}),
    "whitened": ("false", {}),
    "diffusion": ("0.5", {}),
    "start": ("patches", {}),
    "patch": ("0.25", PATCHES),
    "noise": ("0.5", {}),
    "optimizer": ("lbfgs", {}),
    "lr": ("0.1", {}),
    "milestones": ("1", {}),
    "decay": ("0.1", {"milestones": "1"}),
    "shared_moment": ("false", {}),
}


def test_every_setting_has_a_case():
    """Those of words in test_words."""
    names = {field.name for field in fields(surface.SurfaceConfig)}
    assert {name for name in names if name.partition("_")[0] != "text"} == {*CASES, *UNCHANGED}


@cache
def cobblestone() -> Exemplar:
    return Exemplar.load("cobblestone").resized(48)


def synthesize(folder, settings: dict[str, str]) -> np.ndarray:
    settings = BASE | settings
    maps = cobblestone().maps if settings.pop("maps", "") else {"albedo": cobblestone().maps["albedo"]}
    content = settings.pop("content", None)
    overrides = [f"{key}={value}" for key, value in settings.items()]
    return surface.fit(Exemplar(maps), MESH, folder, set=overrides, content=content).values


@pytest.fixture(scope="module")
def bases(tmp_path_factory):
    """The textures that others are compared with, by their settings."""
    textures: dict[str, np.ndarray] = {}

    def base(settings: dict[str, str]) -> np.ndarray:
        if str(settings) not in textures:
            textures[str(settings)] = synthesize(tmp_path_factory.mktemp("base") / "run", settings)
        return textures[str(settings)]

    return base


@pytest.mark.parametrize("key", CASES)
def test_a_setting_changes_the_texture(bases, tmp_path, key):
    """By more than rounding; the same settings give the same texture to the last bit."""
    threads(1)
    value, settings = CASES[key]
    base = bases(settings)
    other = synthesize(tmp_path / "other", settings | {key: value})
    assert np.isfinite(other).all()
    assert base.shape != other.shape or np.abs(base - other).max() > 1e-3
    if key == "seed":
        assert np.array_equal(base, synthesize(tmp_path / "again", settings))
