"""Trains the embedded vision-language model on captioned patterns, and measures it.

    python tools/train_words.py draw PICTURES.npy [--count N]
    python tools/train_words.py train PICTURES.npy RUN [--steps N] [--resume]
    python tools/train_words.py finish RUN

`draw` makes 60,000 pictures in about two minutes, 1.2 GB. `train` takes 37 minutes on two threads with
nothing beside, and leaves checkpoints in the folder RUN, from which `--resume` goes on; beside other
work, one thread is best (OMP_NUM_THREADS=1). `finish` takes the averaged weights of the last checkpoint,
also while a training runs. It prints how often the right text is found for a picture, and writes the
weights into the package; their SHA-256 belongs into `mitex/features/weights.py`.
"""

from __future__ import annotations

import argparse
import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from safetensors.torch import save_file
from word_augmentation import augmented
from word_captions import VALUES, describe, other, true_of
from word_patterns import KINDS
from word_pictures import Subject, draw_subject, render
from word_retrieval import retrieval

from mitex.features.weights import FOLDER, WORDS_FILE
from mitex.features.words.network import RESOLUTION, SIZE, WordsNetwork, numbered
from mitex.paths import atomic_write
from mitex.training import ParameterTask, Step, checkpoint, train
from mitex.training.control import Control, Progress
from mitex.training.optim import Adam

SIDE = 80  # of the pictures, of which pieces are trained on [px]
AVERAGED = 300  # steps over which the weights that are shipped are averaged
WARM_UP = 100  # steps in which the learning rate rises
MISLEADING = (1500, 2300)  # steps between which the changes that mislead grow
SHOWN = 50  # steps between lines of progress
ALIKE = 16  # pictures of the same two colours in a row: only their patterns tell them apart
SEED = 1
WEIGHTS = {"kind": 2.0}  # of what linear maps tell: patterns are the hardest


@dataclass(frozen=True)
class Config:
    """How the network is trained."""

    steps: int = 6400
    seed: int = 0
    checkpoint_every: int = 100
    preview_every: int = 0
    batch: int = 128
    lr: float = 3e-3
    attack: float = 2.0  # largest norm of the changes that are made to mislead the network


def subjects(count: int) -> list[Subject]:
    """The subjects of the training: none of the combinations that are held out."""
    rng, drawn = np.random.default_rng(SEED), []
    while len(drawn) < count:
        subject = draw_subject(rng)
        if not subject.held_out:
            drawn.append(subject)
    return drawn


def _alike(subjects: list[Subject]) -> list[list[int]]:
    """Places of the subjects that have the same two colours."""
    places: dict[tuple[str, ...], list[int]] = {}
    for i, subject in enumerate(subjects):
        places.setdefault(tuple(sorted((subject.figure, subject.ground))), []).append(i)
    return list(places.values())


class ClippedAdam(Adam):
    """Adam on gradients whose norm is at most 1."""

    def step(self, lr: float) -> None:
        torch.nn.utils.clip_grad_norm_(self.parameters, 1.0)
        super().step(lr)


class WordsTask(ParameterTask):
    """Pictures and captions told from each other, each batch a second time with pictures made to mislead.

    Trained for that, a network has gradients that people recognise (Engstrom et al. 2019, "Adversarial
    robustness as a prior for learned representations"). The changes are the gradients of the first time, so
    that they cost nothing (Shafahi et al. 2019, "Adversarial training for free!").
    """

    def __init__(self, config: Config, pictures: np.ndarray) -> None:
        torch.manual_seed(config.seed)
        self.config, self.network = config, WordsNetwork()
        self.network.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
        self.pictures, self.subjects = pictures, subjects(len(pictures))
        self.alike = _alike(self.subjects)
        self.again: tuple[torch.Tensor, list[int]] | None = None
        self.heads = torch.nn.ModuleDict({key: torch.nn.Linear(SIZE, len(VALUES[key])) for key in VALUES})
        heads = {f"heads.{name}": value for name, value in self.heads.named_parameters()}
        super().__init__(dict(self.network.named_parameters()) | heads)
        self.learned = {k: v for k, v in self.network.state_dict().items() if v.is_floating_point()}
        self.average = {name: value.detach().clone() for name, value in self.learned.items()}

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """One batch; the metric is the share of pictures whose caption is found among all."""
        fresh = self.again is None
        images, indices = self._draw(generator) if self.again is None else self.again
        images.requires_grad_()
        seed = int(torch.randint(2**31, (), generator=generator))
        value, metrics = self._contrast(images, [self.subjects[i] for i in indices], seed)
        begin, end = MISLEADING
        most = self.config.attack * min(1, max(0, step - begin) / (end - begin))
        size = most * torch.rand(len(images), 1, 1, 1, generator=generator)

        def commit() -> None:
            if fresh and images.grad is not None and most:
                slope = images.grad / images.grad.flatten(1).norm(dim=1).clamp(min=1e-12)[:, None, None, None]
                self.again = (images.detach() + size * slope).clamp(0, 1), indices
            else:
                self.again = None
            for name, average in self.average.items():
                average.lerp_(self.learned[name], max(1 / (1 + step), 1 / AVERAGED))

        return Step(
            value,
            {f"{name}_{'fresh' if fresh else 'misled'}": number for name, number in metrics.items()},
            commit,
        )

    def _draw(self, generator: torch.Generator) -> tuple[torch.Tensor, list[int]]:
        rng = np.random.default_rng(int(torch.randint(2**31, (), generator=generator)))
        indices = rng.integers(len(self.pictures), size=self.config.batch).tolist()
        for start in range(0, self.config.batch // 2, ALIKE):
            same = self.alike[rng.integers(len(self.alike))]
            indices[start : start + ALIKE] = rng.choice(same, ALIKE).tolist()
        images = torch.from_numpy(self.pictures[indices]).permute(0, 3, 1, 2) / 255
        return augmented(images, RESOLUTION, generator), indices

    def _contrast(
        self, images: torch.Tensor, shown: list[Subject], seed: int
    ) -> tuple[torch.Tensor, dict[str, float]]:
        """InfoNCE both ways; each picture has one more text, which is nearly right, to be told from its own.

        Texts that happen to be true of a picture as well do not count.
        """
        rng = np.random.default_rng(seed)
        captions = [describe(subject, rng) for subject in shown]
        captions += [describe(other(subject, rng), rng) for subject in shown]
        with torch.autocast("cpu", torch.bfloat16):
            pictures = self.network.image(images.contiguous(memory_format=torch.channels_last))
            texts = self.network.text(numbered([caption.concepts for caption in captions]))
        likeness = F.normalize(pictures.float(), dim=1) @ F.normalize(texts.float(), dim=1).T
        right = torch.eye(len(shown), len(captions), dtype=torch.bool)
        logits = likeness * self.network.log_scale.clamp(max=4).exp()
        logits = logits.masked_fill(true_of(captions, shown) & ~right, -math.inf)
        target = torch.arange(len(shown))
        own = logits[:, : len(shown)]
        loss = (F.cross_entropy(logits, target) + F.cross_entropy(own.T, target)) / 2
        attributes, kinds = self._attributes(pictures.float(), shown)
        accuracy = (logits.argmax(1) == target).float().mean().item()
        return loss + attributes, {"accuracy": accuracy, "kinds": kinds}

    def _attributes(self, pictures: torch.Tensor, shown: list[Subject]) -> tuple[torch.Tensor, float]:
        """How well linear maps tell the attributes, for a faster training; the share of right patterns."""
        losses, right = [], 0.0
        for key, head in self.heads.items():
            told = torch.tensor([VALUES[key].index(getattr(s, key)) for s in shown])
            logits = head(pictures)
            if key in ("figure", "ground"):  # which of them is which cannot be told in all patterns
                told[torch.tensor([KINDS[s.kind].equal for s in shown])] = -100
            if key == "kind":
                right = (logits.argmax(1) == told).float().mean().item()
            losses.append(WEIGHTS.get(key, 0.3) * F.cross_entropy(logits, told))
        return torch.stack(losses).sum(), right

    def state(self) -> dict[str, torch.Tensor]:
        averages = {f"average/{name}": value for name, value in self.average.items()}
        return self.learned | super().state() | averages

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        super().load_state(state)
        for name, value in self.average.items():
            value.copy_(state[f"average/{name}"])
            self.learned[name].copy_(state[name])

    def metadata(self) -> dict[str, str]:
        return {"method": "words"}


def draw(file: Path, count: int) -> None:
    """Makes the pictures of the training."""
    every, pictures = subjects(count), np.empty((count, SIDE, SIDE, 3), np.uint8)
    for start in range(0, count, 4000):
        pictures[start : start + 4000] = render(every[start : start + 4000], SIDE, seed=start)
        print(f"{min(start + 4000, count)} of {count}", flush=True)
    np.save(file, pictures, allow_pickle=False)


def learn(pictures: Path, run: Path, config: Config, resume: bool) -> None:
    """Trains, with a learning rate that rises at first and then falls along a cosine."""

    def lr(step: int) -> float:
        return config.lr * min(1, step / WARM_UP) * (0.5 + 0.5 * math.cos(math.pi * step / config.steps))

    def show(progress: Progress) -> None:
        if progress.step % SHOWN < 2:
            print(f"step {progress.step}, {progress.metrics}, {progress.seconds:.0f} s", flush=True)

    task = WordsTask(config, np.load(pictures, allow_pickle=False))
    train(task, config, run, lr=lr, optimizer=ClippedAdam, resume=resume, control=Control(on_step=show))


def finish(run: Path) -> None:
    """Measures the averaged weights as they are shipped, in half precision, and writes them."""
    saved = checkpoint.load(run)
    network = WordsNetwork().requires_grad_(False).eval()
    averages = {k.removeprefix("average/"): v for k, v in saved.task.items() if k.startswith("average/")}
    network.load_state_dict(averages, strict=False)  # all but the counts of batches
    network.half().float()
    about = {"training_steps": str(saved.step), "training_seconds": f"{saved.seconds:.0f}"}
    for name, share in retrieval(network).items():
        print(f"{name:32} {100 * share:.1f} %")
        about[name.replace(" ", "_")] = f"{share:.3f}"
    path = FOLDER / WORDS_FILE
    with atomic_write(path) as temporary:
        halves = {name: value.contiguous() for name, value in network.half().state_dict().items()}
        save_file(halves, temporary, about)
    print(about, path.stat().st_size, hashlib.sha256(path.read_bytes()).hexdigest())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("finish").add_argument("run", type=Path)
    drawing, training = commands.add_parser("draw"), commands.add_parser("train")
    for command in (drawing, training):
        command.add_argument("pictures", type=Path)
    drawing.add_argument("--count", type=int, default=60_000)
    training.add_argument("run", type=Path)
    training.add_argument("--steps", type=int, default=Config.steps)
    training.add_argument("--resume", action="store_true")
    options = parser.parse_args()
    if options.command == "finish":
        finish(options.run)
    elif options.command == "draw":
        draw(options.pictures, options.count)
    else:
        learn(options.pictures, options.run, Config(steps=options.steps), options.resume)


if __name__ == "__main__":
    main()
