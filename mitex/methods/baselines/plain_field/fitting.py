"""Training a plain field: from photos to a model file, for so many steps or for so long."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from mitex.methods.baselines.plain_field.config import PRESETS, PlainFieldConfig
from mitex.methods.baselines.plain_field.texture import SETTINGS, PlainFieldTexture
from mitex.methods.nerf.capture.capture import Capture, load_capture
from mitex.methods.nerf.training.plain import PlainTask, train_plain_field
from mitex.methods.nerf.training.radiance import schedule
from mitex.runtime import init, keep_freed_memory
from mitex.training.control import Control, Progress
from mitex.training.fit import Run
from mitex.training.settings import RunOptions

PROBED = 1000  # steps of the training that tells the pace
LAST = 200  # of these, the last ones whose pace counts


def fit(
    capture: Capture | str | Path, out: str | Path | None = None, **options: Unpack[RunOptions]
) -> PlainFieldTexture:
    """Learns a plain field from photos; writes a run folder with the model in it.

    Every eighth view is held out; previews show the first of these.

    Args:
        capture: photos with masks and cameras, or the folder that `load_capture` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        options: preset ("fast" or "paper", as of the texture that it is compared with), and those of
            `RunOptions`; the setting `seconds` is for equal time. A run that is resumed keeps the number of
            steps that its time was enough for.

    Returns:
        The field, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    training_run = Run.of(PRESETS, out, **options)
    photos = capture if isinstance(capture, Capture) else load_capture(capture)
    init(needs="ad")
    keep_freed_memory()
    training, held_out = photos.split()
    if training_run.config.seconds and not training_run.resume:
        config = for_its_time(training_run.config, training, training_run.control)
        training_run = replace(training_run, config=config)
    config = training_run.config
    task = PlainTask(config, training, (held_out, 0))
    origin: dict[str, Any] = {key: getattr(config, key) for key in SETTINGS}
    origin |= {"centre": photos.similarity.centre.tolist(), "scale": float(photos.similarity.scale)}
    return training_run.train(
        task,
        photos.name,
        lambda about: PlainFieldTexture(task.mean, task.occupancy.occupied, about | origin),
        **schedule(config),
    )


def for_its_time(config: PlainFieldConfig, capture: Capture, control: Control) -> PlainFieldConfig:
    """The settings with as many steps as `seconds` are enough for, by the pace of a short training.

    Its first steps do not count for the pace: they are slow, since nothing hides anything yet.
    """
    short = replace(config, steps=PROBED, preview_every=0, checkpoint_every=PROBED)
    clock = []

    def on_step(progress: Progress) -> None:
        if progress.metrics:
            clock.append(progress.seconds)
        if control.on_step is not None:
            control.on_step(progress)

    train_plain_field(short, capture, (capture, 0), control=replace(control, on_step=on_step))
    steps = steps_within(config.seconds, clock)
    return replace(config, steps=steps, lr_steps=steps)


def steps_within(seconds: float, clock: Sequence[float]) -> int:
    """How many steps a time is enough for, at least one.

    Args:
        seconds: the time.
        clock: seconds that had passed after each of the first steps, two or more, increasing; the last 200
            tell the pace of those that follow.
    """
    if seconds <= clock[-1]:
        return max(1, bisect_right(clock, seconds))
    last = min(LAST, len(clock) - 1)
    return len(clock) + int((seconds - clock[-1]) * last / (clock[-1] - clock[-1 - last]))
