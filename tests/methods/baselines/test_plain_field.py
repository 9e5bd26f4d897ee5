"""The plain field: how many steps a time is enough for, and that it learns to see held-out views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitex.evaluation.metrics import psnr
from mitex.methods.baselines import plain_field
from mitex.methods.nerf.config import PRESETS
from mitex.methods.nerf.field.rendering import render_view
from mitex.training import run
from tests.methods.nerf.tiny import tiny_capture

SLOW, PACE = np.full(800, 0.2), np.full(200, 0.1)  # seconds of the steps of a probe


@pytest.mark.parametrize(
    ("seconds", "steps"),
    [
        (180.0 + 50.0, 1500),  # the first thousand take 180 s, then ten are made in a second
        (180.0, 1000),
        (100.0, 500),
        (1e-9, 1),
    ],
)
def test_steps_within_a_time(seconds, steps):
    clock = np.cumsum(np.concatenate([SLOW, PACE])).tolist()
    assert plain_field.steps_within(seconds + 1e-3, clock) == pytest.approx(steps, abs=1)


def test_a_plain_field_learns_for_the_steps_of_its_time(monkeypatch, tmp_path):
    given = []

    def steps_within(seconds, clock):
        given.append((seconds, len(clock)))
        return 120

    monkeypatch.setattr(plain_field, "PROBED", 3)
    monkeypatch.setattr(plain_field, "steps_within", steps_within)
    config = replace(PRESETS["fast"], rays=1024, ray_steps=192, table=13, occupancy=48, average=0.5)
    learned, held = tiny_capture().split()
    task = plain_field.fit_plain(learned, tmp_path / "run", config, 12.0, (held, 0))
    assert given == [(12.0, 3)]
    assert len((tmp_path / "run" / run.METRICS).read_text().splitlines()) == 120
    assert task.config.lr_steps == 120
    seen, photo = render_view(task.field(task.mean), held, 0)
    assert psnr(seen, photo) > 3 + psnr(np.ones_like(photo), photo)
