"""A plain hash-grid radiance field, trained for as long as a texture was: what its view synthesis is compared
with (Huang et al. 2023, section 4.2)."""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path

from mitex.methods.nerf.capture import Capture
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.plain import PlainTask, trained
from mitex.training import run

WARM, PROBED = 100, 300  # steps before and after which the clock is read


def fit_plain(
    capture: Capture,
    out: str | Path,
    config: NerfConfig,
    seconds: float,
    shown: tuple[Capture, int] | None = None,
    quiet: bool = True,
) -> PlainTask:
    """Trains a plain field for a time; its model is `field(task.mean)`.

    How many steps that is, is found by a short training before; the learning rate falls over all of them.

    Args:
        capture: views to learn from.
        out: run folder, new or empty; an interrupted training in it goes on.
        config: settings; those of the texture make the two alike in rays, steps along them, and table size.
        seconds: that the training may take.
        shown: a view for previews, as (capture, index).
        quiet: show no progress.

    Raises:
        MitexError: as `fit`.
    """
    view = shown or (capture, 0)
    with tempfile.TemporaryDirectory() as probe:
        short = replace(config, steps=PROBED, preview_every=0, checkpoint_every=PROBED, refine_cameras=False)
        trained(short, capture, view, Path(probe) / "run", quiet=True)
        lines = (Path(probe) / "run" / run.METRICS).read_text().splitlines()
    before, after = (json.loads(lines[k - 1])["seconds"] for k in (WARM, PROBED))
    steps = max(1, round(seconds * (PROBED - WARM) / (after - before)))
    whole = replace(short, steps=steps, lr_steps=steps, checkpoint_every=500)
    return trained(whole, capture, view, out, quiet)
