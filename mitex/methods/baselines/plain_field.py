"""A plain hash-grid radiance field, trained for as long as a texture was: what its view synthesis is compared
with (Huang et al. 2023, section 4.2)."""

from __future__ import annotations

import json
import tempfile
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.training.plain import PlainTask, train_plain_field
from mitex.training import run

PROBED, LAST = 1000, 200  # steps of the training that tells the pace, and of those the ones that tell it


def fit_plain(
    capture: Capture,
    out: str | Path,
    config: NerfConfig,
    seconds: float,
    preview_view: tuple[Capture, int] | None = None,
    quiet: bool = True,
) -> PlainTask:
    """Trains a plain field for a time; its model is `field(task.mean)`.

    How many steps that is, is found by a short training before; the learning rate falls over all of them. The
    first steps are slow, since nothing hides anything yet.

    Args:
        capture: views to learn from.
        out: run folder, new or empty; an interrupted training in it goes on.
        config: settings; those of the texture make the two alike in rays, steps along them, and table size.
        seconds: that the training may take.
        preview_view: a view for previews, as (capture, index).
        quiet: show no progress.

    Raises:
        MitexError: as `fit`.
    """
    view = preview_view or (capture, 0)
    with tempfile.TemporaryDirectory() as probe:
        short = replace(config, steps=PROBED, preview_every=0, checkpoint_every=PROBED, refine_cameras=False)
        train_plain_field(short, capture, view, Path(probe) / "run", quiet=True)
        lines = (Path(probe) / "run" / run.METRICS).read_text().splitlines()
    steps = steps_within(seconds, [json.loads(line)["seconds"] for line in lines])
    whole = replace(short, steps=steps, lr_steps=steps, checkpoint_every=500)
    return train_plain_field(whole, capture, view, out, quiet)


def steps_within(seconds: float, clock: Sequence[float]) -> int:
    """How many steps a time is enough for, at least one.

    Args:
        seconds: that there are.
        clock: seconds that had passed after each of the first steps, increasing; the last 200 tell the pace
            of those that follow.
    """
    if seconds <= clock[-1]:
        return max(1, bisect_right(clock, seconds))
    last = min(LAST, len(clock) - 1)
    return len(clock) + int((seconds - clock[-1]) * last / (clock[-1] - clock[-1 - last]))
