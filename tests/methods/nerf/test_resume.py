"""An interrupted fit that goes on is, on one thread and to the bit, the fit of one go."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from mitex.mesh import Mesh
from mitex.methods.nerf import PRESETS, fit
from mitex.methods.nerf.field import occupancy
from mitex.methods.nerf.training import radiance, task
from mitex.methods.nerf.training.plain import train_plain_field
from mitex.methods.nerf.training.task import TextureTask
from mitex.runtime import threads
from mitex.training import Interrupted, checkpoint
from mitex.training.config import resolve
from mitex.training.locate import NAME
from tests.methods.fits import untrained_bases
from tests.methods.nerf.tiny import SETTINGS, tiny_capture

SMALL = (
    *(s for s in SETTINGS if not s.startswith(("steps", "lr_steps", "occupancy", "preview", "checkpoint"))),
    "lr_steps=10",
    "occupancy=24",
    "preview_every=4",
    "checkpoint_every=2",
    "rays=128",
    "interior_weight=0.01",
    "learn_light=true",
    "refine_cameras=true",
    "exposures=true",
)
# Every `REFRESH` steps the occupancy is refreshed and the mean updated: before and after an interruption. The
# inside counts from step 5 on, before a fit of 8 steps ends.
REFRESH, BEFORE, LATE, STEPS = 4, 5, 8, 10


@pytest.fixture(scope="module", autouse=True)
def _one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    threads(1)
    with pytest.MonkeyPatch.context() as patch:
        untrained_bases(patch)
        patch.setattr(radiance, "REFRESH", REFRESH)
        patch.setattr(task, "SURFACE", 0.005)  # of the fog after so few steps
        patch.setattr(occupancy, "WARMUP", 1)  # after which cells are drawn by chance
        yield
    threads(before)


@pytest.fixture(scope="module")
def whole(base, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "run"
    small_fit(folder, base, *SMALL, f"steps={STEPS}")
    return folder


def small_fit(folder: Path, base: Mesh, *settings: str, resume: bool = False) -> None:
    fit(tiny_capture(), folder, base_mesh=base, set=settings, resume=resume)


def assert_same(a: Path, b: Path) -> None:
    """Every tensor of the checkpoint and of the model, and every number of metrics.jsonl but the time."""
    for one, other in zip(tensors(a), tensors(b), strict=True):
        assert one.keys() == other.keys()
        assert [name for name in one if not torch.equal(one[name], other[name])] == []
    assert metrics(a) == metrics(b)


def tensors(folder: Path) -> list[dict[str, torch.Tensor]]:
    saved = checkpoint.load(folder)
    rest = {"generator": saved.generator, "loss": torch.tensor(saved.loss)}
    return [saved.task, saved.optimizer, rest, load_file(folder / NAME)]


def metrics(folder: Path) -> list[dict[str, float]]:
    lines = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    return [{name: value for name, value in line.items() if name != "seconds"} for line in lines]


def test_the_comparison_covers_what_a_fit_holds(whole):
    state, optimizer, _, model = tensors(whole)
    kinds = {"parameters/tables/f", "parameters/poses", "parameters/exposures", "parameters/light"}
    assert (
        kinds | {"mean/weights/0", "occupancy"} <= state.keys()
        and {"tables/f", "light", "occupied"} <= model.keys()
    )
    assert int(state["refreshes"]) == 1 + (STEPS - 1) // REFRESH
    for name in (
        "tables/f",
        "light",
        "poses",
        "exposures",
    ):  # all of these have moved, so that a lost one would show
        assert not torch.equal(state[f"mean/{name}"], state[f"parameters/{name}"])
    assert all(value.abs().max() > 0 for name, value in optimizer.items() if name.startswith("first"))
    assert "interior" in metrics(whole)[-1]


def test_an_interrupted_fit_is_that_of_one_go(whole, base, tmp_path, monkeypatch):
    average = TextureTask._average

    def stop(trained: TextureTask) -> None:
        average(trained)
        if trained._commits == BEFORE:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(TextureTask, "_average", stop)
    with pytest.raises(Interrupted):
        small_fit(tmp_path / "run", base, *SMALL, f"steps={STEPS}")
    monkeypatch.undo()
    assert checkpoint.load(tmp_path / "run").step == BEFORE
    small_fit(tmp_path / "run", base, resume=True)
    assert_same(tmp_path / "run", whole)


def test_a_fit_that_goes_on_for_more_steps_is_that_of_one_go(whole, base, tmp_path):
    small_fit(tmp_path / "run", base, *SMALL, f"steps={LATE}")
    small_fit(tmp_path / "run", base, f"steps={STEPS}", resume=True)
    assert_same(tmp_path / "run", whole)


def test_a_plain_field_that_goes_on_is_that_of_one_go(tmp_path):
    capture = tiny_capture()
    settings = replace(resolve(PRESETS, overrides=SMALL), preview_every=0)
    for name, parts in (("whole", (STEPS,)), ("parts", (BEFORE, STEPS))):
        for steps in parts:
            train_plain_field(replace(settings, steps=steps), capture, (capture, 0), tmp_path / name)
    a, b = (checkpoint.load(tmp_path / name) for name in ("whole", "parts"))
    for one, other in ((a.task, b.task), (a.optimizer, b.optimizer), ({"": a.generator}, {"": b.generator})):
        assert [name for name in one if not torch.equal(one[name], other[name])] == []
