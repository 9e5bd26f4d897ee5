"""Variants of the rule, and what the tool measures of one."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from mitex.mesh import icosphere
from mitex.methods.nca import PRESETS, NcaTexture
from mitex.training import resolve
from tests.methods.nca import tiny
from tools import compare_rules


def test_each_variant_differs_in_one_setting_from_the_first():
    first, *others = (asdict(resolve(PRESETS, overrides=own)) for own in compare_rules.VARIANTS.values())
    differing = [[key for key in first if first[key] != other[key]] for other in others]
    assert all(len(keys) == 1 for keys in differing)
    settings = [(keys[0], other[keys[0]]) for keys, other in zip(differing, others, strict=True)]
    assert len(set(settings)) == len(settings) and {key for key, _ in settings} == {
        "degree",
        "hidden",
        "channels",
    }


def test_a_closeup_is_as_wide_as_the_exemplar(monkeypatch):
    """In edges of the sphere that it is grown on, and the same for all textures of one density."""
    monkeypatch.setattr(compare_rules, "CELL", 16)
    mesh, texture = icosphere(16), tiny.texture()
    cameras = [
        compare_rules.closeup(NcaTexture(texture.look, {"density": density}), mesh) for density in (4, 4, 8)
    ]
    width = 2 * cameras[0].half_width / mesh.edge_lengths.mean()
    assert width == pytest.approx(4, rel=0.05) and cameras[2].half_width == 2 * cameras[0].half_width
    assert np.array_equal(cameras[0].origin, cameras[1].origin)
    picture = compare_rules.albedo(NcaTexture(texture.look, {"growth_steps": 4}), mesh, cameras[0])
    assert picture.shape == (16, 16, 3) and np.ptp(picture) > 0.01


def test_a_row(tmp_path):
    """The last 20 losses, a picture like the exemplar, the weights, and the time between two steps."""
    lines = [{"appearance": 100.0 if k < 5 else 1.0 + (k < 10), "seconds": 0.5 * k} for k in range(25)]
    (tmp_path / "metrics.jsonl").write_text("\n".join(map(json.dumps, lines)))
    picture = np.random.default_rng(0).random((32, 32, 3)).astype(np.float32)
    texture = tiny.texture(hidden=8, channels=12)
    loss, near, far, weights, seconds = compare_rules.row(texture, tmp_path, picture, picture)
    assert (loss, weights, seconds) == ("1.25", f"{60 * 8 + 8 + 8 * 12 + 12:,}", "0.50")
    assert max(abs(float(near)), abs(float(far))) < 1e-2
    _, near, far, *_ = compare_rules.row(texture, tmp_path, picture, 0.5 * picture)
    assert min(float(near), float(far)) > 0.1
