"""What makes the work of the pages' commands small, and the files that they name.

Nothing of a command is changed. Three things that take minutes are made small below it, wherever it comes from:

- settings: those of a fit are resolved as they were asked for, which checks them, then again with `STEPS` and the
  tiny ones of its method on top;
- paths: a picture is traced with one path a pixel, and a film shows its first picture in all frames;
- the base shape of a capture, which takes CoACD a minute, is given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mitex.methods.registry import methods
from mitex.training.run import CONFIG
from tests.cli import bad_files
from tests.methods.fits import RADIANCE, SMALL_RUN

STEPS, RESUMED_STEPS = 2, 3
TINY = {
    # Nothing of the architecture, which must be that of the model after `--init`.
    "nca": "frequency=4 pool=1 view_count=1 resolution=32 target_size=32 exemplar_size=32 min_steps=2 max_steps=2 "
    "layers=relu1_1 order_weight=0 zooms=1",
    "surface": "resolution=32 exemplar_size=32 scales=0 layers=relu1_1",
    "geometric": "level_steps=2 fit_steps=10 fit_samples=100",
    "nerf": f"base_steps=150 coarsest=8 finest=32 {RADIANCE}",
}


def prepare(folder: Path) -> None:
    """Writes the files that pages name and that the user brings along."""
    from tests.cli.test_nerf import icosphere, save
    from tests.methods.nerf.capture.test_capture import write

    save(icosphere(6), folder / "bunny.obj")
    bad_files.image(folder / "photo.png")
    (folder / "maps").mkdir()
    bad_files.image(folder / "maps" / "albedo.png")
    (folder / "captures").mkdir()
    for name in ("durian", "captures/cobbles"):
        write(folder / name, 16)


def shrink(patch: pytest.MonkeyPatch) -> None:
    """Makes fits and pictures small until the patch is undone."""
    from mitex.render import renderer, shell
    from mitex.training import fit

    patch.setattr(fit, "resolve", _small_settings(fit.resolve))
    sketch = _one_path(renderer.accumulated)
    patch.setattr(renderer, "accumulated", sketch)
    patch.setattr(shell, "accumulated", sketch)


def _small_settings(resolve: Callable[..., Any]) -> Callable[..., Any]:
    def small(presets: Mapping[str, Any], preset: str | None, file: Path | None, overrides: Any) -> Any:
        resolve(presets, preset, file, overrides)
        name = next((name for name, one in methods().items() if one.load_presets() is presets), "")
        resumed = file is not None and file.name == CONFIG
        steps = f"steps={RESUMED_STEPS if resumed else STEPS}"
        tiny = [*TINY.get(name, "").split(), steps, *SMALL_RUN.split()]
        return resolve(presets, preset, file, [*overrides, *tiny])

    return small


def _one_path(accumulated: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
    pictures: dict[int, tuple[Any, np.ndarray]] = {}

    def sketch(scene: Any, resolution: int, spp: int, seed: int) -> np.ndarray:
        assert 1 <= spp <= 65536
        if id(scene) not in pictures:  # the scene is kept, so that its id stays its own
            pictures[id(scene)] = scene, accumulated(scene, resolution, 1, seed)
        return pictures[id(scene)][1]

    return sketch
