"""Learning a box: from a captured texture to a model file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Unpack

from mitex.methods.baselines.nerf_tex.box import main_direction, picture_box, possible_cells, take_box
from mitex.methods.baselines.nerf_tex.config import PRESETS
from mitex.methods.baselines.nerf_tex.task import BoxTask
from mitex.methods.baselines.nerf_tex.texture import SETTINGS, NerfTexTexture
from mitex.methods.checks import reject_idle
from mitex.methods.nerf.texture import NerfTexture
from mitex.methods.nerf.training.radiance import schedule
from mitex.runtime import init, keep_freed_memory
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    texture: NerfTexture | str | Path, out: str | Path | None = None, **options: Unpack[RunOptions]
) -> NerfTexTexture:
    """Learns a piece of a captured texture, laid flat in a box; writes a run folder with the model in it.

    Pictures of the piece are made first; every eighth is held out, and previews show the first of these.

    Args:
        texture: captured, or what `NerfTexture.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        options: preset ("default" or "paper"), and those of `RunOptions`.

    Returns:
        The box, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    config = run.config
    if config.network == "frequencies":
        reject_idle(options.get("set", ()), {"table"}, "without a hash grid")
    captured = texture if isinstance(texture, NerfTexture) else NerfTexture.load(texture)
    init(needs="ad")
    keep_freed_memory()
    box = take_box(captured, config.patch, config.seed)
    pictures, lights = picture_box(box, config.views, config.view, config.seed)
    task = BoxTask(config, pictures, lights, possible_cells(box, config.occupancy))
    origin: dict[str, Any] = {key: getattr(config, key) for key in SETTINGS}
    origin |= {"half": box.half, "ground": captured.ground, "light": main_direction(box.light).tolist()}
    return run.train(
        task,
        str(captured.about["name"]),
        lambda about: NerfTexTexture(task.mean, task.occupancy.occupied, about | origin),
        **schedule(config),
    )
