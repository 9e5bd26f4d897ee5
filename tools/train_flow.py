"""Trains the network that estimates the motion between two frames, and measures it.

    python tools/train_flow.py train RUN [--steps N] [--resume]
    python tools/train_flow.py finish RUN

`train` takes about 45 minutes on two cores and leaves checkpoints in the folder RUN, from which `--resume`
goes on. `finish` takes the averaged weights of the last checkpoint, also while a training runs. It prints
their errors on textures of other kinds by octave of speed, beside Lucas and Kanade's method and no motion,
and writes the weights into the package; their SHA-256 belongs into `mitex/features/weights.py`.
"""

from __future__ import annotations

import argparse
import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from flow_errors import held_out, table
from flow_pairs import PairMaker
from flow_textures import TRAINED, textures
from safetensors.torch import save_file

from mitex.evaluation.motion import motion_errors
from mitex.features.flow import FlowNetwork
from mitex.features.weights import FLOW_FILE, FOLDER
from mitex.paths import atomic_write
from mitex.training import ParameterTask, Step, checkpoint, train
from mitex.training.control import Control, Progress
from mitex.training.optim import Adam

AVERAGED = 500  # steps over which the weights that are shipped are averaged
WARM_UP = 200  # steps in which the learning rate rises
SHOWN = 100  # steps between lines of progress


@dataclass(frozen=True)
class Config:
    """How the network is trained."""

    steps: int = 6500
    seed: int = 0
    checkpoint_every: int = 250
    preview_every: int = 0
    batch: int = 8
    side: int = 96
    lr: float = 1e-3


class ClippedAdam(Adam):
    """Adam on gradients whose norm is at most 1: otherwise the network falls to no motion for good."""

    def step(self, lr: float) -> None:
        torch.nn.utils.clip_grad_norm_(self.parameters, 1.0)
        super().step(lr)


class FlowTask(ParameterTask):
    """End-point errors of all passes, on pairs drawn anew in every step."""

    def __init__(self, config: Config, images: np.ndarray) -> None:
        torch.manual_seed(config.seed)
        self.config, self.network = config, FlowNetwork()
        self.pairs = PairMaker(images, config.side)
        super().__init__(dict(self.network.named_parameters()))
        self.average = {name: value.detach().clone() for name, value in self.named.items()}

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """One batch; the metric is the error of the last pass [px]."""
        pairs = self.pairs.draw(self.config.batch, generator)
        with torch.autocast("cpu", torch.bfloat16):
            motions = self.network.estimates(pairs.frames)
        errors = []
        for motion in motions:
            # The small number keeps the gradient finite where an estimate is right.
            distance = ((motion - pairs.motion).square().sum(1) + 1e-4).sqrt()
            errors.append((distance * pairs.mask).mean())

        def commit() -> None:
            for name, value in self.average.items():
                value.lerp_(self.named[name].detach(), max(1 / (1 + step), 1 / AVERAGED))

        return Step(torch.stack(errors).sum(), {"error": errors[-1].item()}, commit)

    def state(self) -> dict[str, torch.Tensor]:
        return super().state() | {f"average/{name}": value for name, value in self.average.items()}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        super().load_state(state)
        for name, value in self.average.items():
            value.copy_(state[f"average/{name}"])

    def metadata(self) -> dict[str, str]:
        return {"method": "flow"}


def learn(run: Path, config: Config, resume: bool) -> None:
    """Trains, with a learning rate that rises at first and then falls along a cosine."""

    def lr(step: int) -> float:
        return config.lr * min(1, step / WARM_UP) * (0.5 + 0.5 * math.cos(math.pi * step / config.steps))

    def show(progress: Progress) -> None:
        if progress.step % SHOWN == 0:
            print(f"step {progress.step}, loss {progress.loss:.3f}, {progress.seconds:.0f} s", flush=True)

    task = FlowTask(config, textures(TRAINED))
    train(task, config, run, lr=lr, optimizer=ClippedAdam, resume=resume, control=Control(on_step=show))


def finish(run: Path) -> None:
    """Measures the averaged weights and writes them into the package."""
    saved = checkpoint.load(run)
    network = FlowNetwork().requires_grad_(False)
    network.load_state_dict({name: saved.task[f"average/{name}"] for name in network.state_dict()})
    about = {"training_steps": str(saved.step), "training_seconds": f"{saved.seconds:.0f}"}
    for look, changes in {"the same": False, "changing": True}.items():
        pairs = held_out(changes)
        print(f"look: {look}\n{table(network, pairs)}\n")
        slow = (pairs.mask == 1) & (pairs.motion.norm(dim=1) <= 2)
        motion = torch.cat([network(frames) for frames in pairs.frames.split(8)])
        about[f"end_point_error_{look.replace(' ', '_')}"] = (
            f"{motion_errors(motion, pairs.motion, slow.float()).end_point:.3f}"
        )
    path = FOLDER / FLOW_FILE
    with atomic_write(path) as temporary:
        save_file(
            {name: value.contiguous() for name, value in network.state_dict().items()}, temporary, about
        )
    print(about, hashlib.sha256(path.read_bytes()).hexdigest())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("finish").add_argument("run", type=Path)
    training = commands.add_parser("train")
    training.add_argument("run", type=Path)
    training.add_argument("--steps", type=int, default=Config.steps)
    training.add_argument("--resume", action="store_true")
    options = parser.parse_args()
    if options.command == "finish":
        finish(options.run)
    else:
        learn(options.run, Config(steps=options.steps), options.resume)


if __name__ == "__main__":
    main()
