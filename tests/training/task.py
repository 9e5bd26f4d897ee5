"""A small stochastic task whose every part must survive a checkpoint; training it, and comparing two runs."""

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.training import Change, Step, checkpoint, train

from .contract import assert_same_checkpoint


@dataclass(frozen=True)
class SmallConfig:
    steps: int = 20
    seed: int = 3
    preset: str = "small"
    lr: float = 0.01
    width: int = 5
    checkpoint_every: int = 5
    preview_every: int = 0
    layers: tuple[str, ...] = ("relu1_1",)


class SmallTask:
    """Fits a random linear map; a pool outside the parameters drifts with each good step.

    On every step but each third one `begin` moves a target, in place. `faults` maps a step to what goes wrong
    there: a function of task and loss that returns a loss.
    """

    def __init__(self, width: int = 5, pool: int = 7, faults=None):
        self.weight = torch.nn.Parameter(torch.linspace(-1, 1, width))
        self.bias = torch.nn.Parameter(torch.zeros(()))
        self.parameters = [self.weight, self.bias]
        self.pool = torch.zeros(pool)
        self.target = torch.ones(())
        self.faults = faults or {}
        self.steps_seen = []

    def begin(self, step, generator):
        if step % 3 == 1:
            return None
        undo = partial(self.move_target, self.target.clone())
        self.target += 0.01 * torch.randn((), generator=generator)
        return Change(undo, {"target": self.target.item()})

    def move_target(self, place):
        self.target.copy_(place)

    def loss(self, step, generator):
        self.steps_seen.append(step)
        x = torch.rand(self.weight.shape, generator=generator)
        drift = torch.randn(self.pool.shape, generator=generator) * 0.1 * self.weight.detach().sum()
        error = (self.weight * x).sum() + self.bias + self.pool.mean() - self.target
        loss = self.faults.get(step, lambda task, loss: loss)(self, error.square())
        return Step(loss, {"error": error.item()}, lambda: self.drift(drift))

    def drift(self, change):
        self.pool = self.pool * 0.9 + change

    def state(self):
        return {"weight": self.weight, "bias": self.bias, "pool": self.pool, "target": self.target}

    @torch.no_grad()
    def load_state(self, state):
        if state["pool"].shape != self.pool.shape:
            raise ValueError(f"pool of {tuple(state['pool'].shape)}")
        self.weight.copy_(state["weight"])
        self.bias.copy_(state["bias"])
        self.pool = state["pool"]
        self.target.copy_(state["target"])

    def preview(self, step):
        return np.full((4, 6, 3), 0.5, np.float32)

    def metadata(self):
        return {"method": "small"}


def train_small(out, task=None, config=None, **options):
    """Trains a task into a folder; returns the task and the result."""
    task = task or SmallTask()
    config = config or SmallConfig()
    arguments: dict[str, Any] = {"lr": config.lr} | options
    return task, train(task, config, out, **arguments)


def lines(folder: Path) -> list[dict]:
    """The records of metrics.jsonl without their times."""
    records = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    return [{key: value for key, value in record.items() if key != "seconds"} for record in records]


def assert_same_run(one: Path, other: Path) -> None:
    """Compares the end of two runs bit by bit: task, optimizer, generator, counters, metrics."""
    assert_same_checkpoint(one, other)
    assert lines(one) == lines(other)
    assert [record["step"] for record in lines(one)] == list(range(1, checkpoint.load(one).step + 1))
