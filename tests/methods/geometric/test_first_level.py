"""A training that begins on a higher level, from the coarse part of the relief."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError
from mitex.mesh import icosphere
from mitex.methods import geometric
from mitex.methods.geometric.config import MAX_LEVELS, PRESETS
from mitex.methods.geometric.texture import START, GeometricTexture
from mitex.runtime import threads
from tests.methods.geometric.small import bumpy, same_weights
from tests.training.contract import assert_same_checkpoint

pytestmark = pytest.mark.usefixtures("own_cache")
SMALL = ["level_steps=3", "fit_steps=20", "fit_samples=200", "checkpoint_every=4", "preview_every=0"]
FINE = [*SMALL, "first_level=2", "fit_blur=1", "steps=6"]
MESH = icosphere(5)


@pytest.fixture(autouse=True, scope="module")
def few_coarse_reliefs():
    """A training starts from few of them, which are quilted from few patches: all of them take seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitex.methods.geometric.fitting.LAID", 3)
        patch.setattr("mitex.methods.geometric.coarse_patches.PLACES", 60)
        yield


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    threads(1)  # whose number changes the last digits
    folder = tmp_path_factory.mktemp("runs") / "bumpy"
    return folder, geometric.fit(bumpy(), folder, set=FINE)


def test_levels_count_from_the_first(run):
    texture = run[1]
    assert texture.levels == 2 and texture.about["first_level"] == 2
    assert [level["faces"] for level in texture.about["fit"]] == [20, 80, 320, 1280]
    assert len(texture.template.faces) == 320
    assert texture.template.edge_lengths.mean() == pytest.approx(1, rel=1e-4)
    assert texture.first == 0 and replace(texture, about=texture.about | {"first_level": 0}).first == START
    assert len(texture.apply(MESH).mesh.faces) == 4 * len(MESH.faces)
    assert texture.relative_size(texture.template) == (1.0, 160)


def test_models_round_trip(run):
    folder, texture = run
    again = GeometricTexture.load(folder)
    assert again.coarse is not None and texture.coarse is not None
    assert np.array_equal(again.coarse.heights, texture.coarse.heights)
    assert dict(again.about) == dict(texture.about)
    assert all(map(same_weights, again.generators, texture.generators))
    assert np.array_equal(again.apply(MESH, seed=1).mesh.vertices, texture.apply(MESH, seed=1).mesh.vertices)


def test_growth_begins_with_the_coarse_relief_laid_anew(run):
    """Unless nothing is to be placed, or a later level begins, for which it is not made."""
    texture = run[1]

    def grown(**options):
        return texture.apply(MESH, **options).mesh.vertices

    flat = replace(texture, fixed=0 * texture.fixed)
    assert not np.allclose(grown(), flat.apply(MESH).mesh.vertices, atol=1e-3)
    assert not np.allclose(grown(), grown(placement="none"), atol=1e-3)
    assert np.array_equal(grown(start_level=1), flat.apply(MESH, start_level=1).mesh.vertices)


def test_variations_of_the_reference(run):
    texture = run[1]
    rebuilt = [texture.generate(seed, start_level=2).vertices for seed in (0, 1)]
    assert np.array_equal(*rebuilt)
    assert not np.allclose(texture.generate(0).vertices, texture.generate(1).vertices, atol=1e-3)


def test_a_film_of_the_template_grows_a_variation_of_the_reference(run):
    texture = run[1]
    *_, last = texture.growth(texture.template, frames=1, seed=1, start_level=0)
    assert np.allclose(last.vertices, texture.generate(1).vertices, atol=1e-5)
    ends = list(texture.interpolate(texture.template, (0, 1), 2, start_level=0))
    for seed, end in enumerate(ends):
        assert np.allclose(end.vertices, texture.generate(seed).vertices, atol=1e-4)


def test_the_reference_is_learned_from_its_own_coarse_relief(run):
    """Longer, the rebuilt mesh comes nearer to the training mesh; metrics tell."""
    folder, _ = run
    longer = folder.parent / "longer"
    geometric.fit(bumpy(), longer, set=[*FINE, "level_steps=40", "steps=40"])
    lines = [
        json.loads(line)["reconstruction"] for line in (longer / "metrics.jsonl").read_text().splitlines()
    ]
    assert np.mean(lines[-5:]) < 0.6 * np.mean(lines[:5])


def test_resuming_changes_nothing(tmp_path, run):
    geometric.fit(bumpy(), tmp_path / "parts", set=[*FINE, "steps=3"])
    again = geometric.fit(bumpy(), tmp_path / "parts", set=FINE, resume=True)
    assert all(map(same_weights, again.generators, run[1].generators))
    assert_same_checkpoint(tmp_path / "parts", run[0])


def test_a_directed_relief_is_laid_along_the_field(tmp_path):
    folder = tmp_path / "run"
    texture = geometric.fit(bumpy(), folder, field="up", set=FINE)
    assert [len(field) for field in texture.fields] == [162, 642]  # vertices of the levels from the first on
    assert texture.coarse is not None and texture.coarse.field is not None and not texture.coarse.symmetric
    with pytest.raises(ConfigError, match="follows a vector field"):
        texture.apply(MESH)
    again = GeometricTexture.load(folder)
    start = [again.rollout(MESH, None, None, field) for field in ("up", "about-y")]
    laid = [again._placed(MESH, 0, "even", 0, field) for field in ("up", "about-y")]
    assert start[0].hierarchy.graphs[0].directions is not None
    assert not np.allclose(*laid, atol=1e-3)
    first, second = (t.apply(MESH, field="up", seed=1).mesh.vertices for t in (texture, again))
    assert np.array_equal(first, second)


def test_too_many_levels(tmp_path):
    with pytest.raises(ConfigError, match=f"set steps to {MAX_LEVELS - 4} or less"):
        geometric.fit(bumpy(), tmp_path / "run", preset="fine", set=["steps=4", "level_steps=1"])
    for name in ("fine", "finest"):
        assert PRESETS[name].first_level + PRESETS[name].levels <= MAX_LEVELS


@pytest.mark.parametrize(
    "about",
    [
        {"first_level": 9},
        {"first_level": 0},
    ],
    ids=["a level that cannot be", "other networks"],
)
def test_damaged_models_are_refused(run, tmp_path, about):
    texture = GeometricTexture.load(run[0])
    replace(texture, about=texture.about | about).save(tmp_path / "texture.safetensors")
    with pytest.raises(CheckpointError, match="geometric texture"):
        GeometricTexture.load(tmp_path)
    assert isinstance(texture.fixed, torch.Tensor)
