"""Every setting of `GeometricConfig` changes what is learned: an ignored one fails here."""

from dataclasses import fields
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
import torch

from mitex.cache import content_key
from mitex.mesh import icosphere
from mitex.methods import geometric
from mitex.methods.geometric.directions import level_fields
from mitex.runtime import threads

pytestmark = pytest.mark.usefixtures("own_cache")
# Four levels, of which the last may start from the weights of the third.
BASE = {
    "steps": 7,
    "level_steps": 2,
    "fit_steps": 3,
    "fit_samples": 100,
    "checkpoint_every": 99,
    "preview_every": 0,
}
UNCHANGED = {
    "preset",
    "device",
    "checkpoint_every",
    "preview_every",
}  # tested with the loop and by test_device
CASES = {
    "steps": 8,
    "seed": 1,
    "level_steps": 3,
    "critic_steps": 1,
    "generator_steps": 1,
    "first_level": 1,
    "noise": 0.2,
    "reconstruction": 1,
    "penalty": 1,
    "lr": 1e-3,
    "beta1": 0.9,
    "beta2": 0.9,
    "remeasure": "true",
    "symmetric": "true",
    "carried": 4,
    "fit_steps": 4,
    "fit_samples": 150,
    "fit_lr": 0.01,
    "fit_normals": 1,
    "fit_uniform": 1,
    "fit_entropy": 1,
    "fit_blur": 1,
    "fit_smooth": 1,
}


FIELDS: dict[str, Any] = {}


def known_fields(reference, vectors, meshes):
    """Most settings leave the training meshes as they are, and the reference's field on them too."""
    arrays = [array for mesh in (reference, *meshes) for array in (mesh.vertices, mesh.faces)]
    key = content_key(vectors, *arrays)
    if key not in FIELDS:
        FIELDS[key] = level_fields(reference, vectors, meshes)
    return [field.clone() for field in FIELDS[key]]


def learned(field: str | None = "up", **settings: object) -> list[torch.Tensor]:
    """The weights after a short fit, without what takes longer: reports on its training meshes, and many
    coarse reliefs to start from."""
    words = [f"{key}={value}" for key, value in (BASE | settings).items()]
    threads(1)
    with (
        patch("mitex.methods.geometric.fitting.report", lambda *_: SimpleNamespace()),
        patch("mitex.methods.geometric.fitting.level_fields", known_fields),
        patch("mitex.methods.geometric.fitting.LAID", 2),
        patch("mitex.methods.geometric.coarse_patches.PLACES", 60),
    ):
        texture = geometric.fit(icosphere(4), field=field, set=words)
    return [p.detach() for generator in texture.generators for p in generator.parameters]


def same(one: list[torch.Tensor], other: list[torch.Tensor]) -> bool:
    return len(one) == len(other) and all(map(torch.equal, one, other))


@pytest.fixture(scope="module")
def base():
    return learned()


def test_every_setting_has_a_case():
    assert {field.name for field in fields(geometric.GeometricConfig)} == {*CASES, *UNCHANGED}


def test_the_same_settings_learn_the_same(base):
    assert same(learned(), base)


@pytest.mark.parametrize("name", CASES)
def test_every_setting_changes_what_is_learned(base, name):
    if name == "first_level":  # not with a field
        assert not same(learned(None, first_level=CASES[name]), learned(None))
    else:
        assert not same(learned(**{name: CASES[name]}), base)
