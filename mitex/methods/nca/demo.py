"""`mitex demo`: the whole way in a few minutes, from an exemplar to textured meshes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.checks import SEEDS, in_range

if TYPE_CHECKING:
    import numpy as np

    from mitex.asset import Asset
    from mitex.exemplar import Exemplar
    from mitex.methods.nca import NcaTexture

EXEMPLAR = "cobblestone"
PARENT = "ceramic"  # the bundled model that the training starts from
MESHES = ("shaderball", "knot")
RESOLUTION = 2048
STEPS = 110  # enough for a first look from the bundled parent
# Half as many views as a long training has, and a higher learning rate.
SETTINGS = ("view_count=2", "lr=0.002")
SIZE, SAMPLES = 512, 64  # of the pictures


@dataclass
class Demo:
    """Learn a texture here and now, put it on two meshes, render and export them; prints the files made.

    A short training starts from a bundled model, which converges faster; calling the command again continues
    where it was stopped.

    examples:
      mitex demo
      mitex demo --out /tmp/demo --seed 3
    """

    out: Annotated[Path, arg(metavar="DIR")] = Path("demo")
    """Folder for everything that is made."""

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed."""

    steps: Annotated[int, arg(metavar="N")] = STEPS
    """Training steps."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        in_range("--seed", self.seed, *SEEDS)
        in_range("--steps", self.steps, 1)
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        start = time.monotonic()
        for path in demo(self.out, self.seed, self.steps, lambda line: print(line, flush=True)):
            print(path)
        print(f"done in {time.monotonic() - start:.0f} s")


def demo(out: Path, seed: int, steps: int, say: Callable[[str], None] = lambda line: None) -> list[Path]:
    """Fits, applies, renders and exports into `out`.

    Args:
        out: Folder; a run in it is continued.
        seed: Of the training and the automaton.
        steps: Of the training.
        say: Told what happens.

    Returns:
        The files made: for each mesh a .glb and a .png, and the sheet that shows the exemplar beside them.

    Raises:
        MitexError: `out` is not usable, or Mitsuba is not.
    """
    from mitex.exemplar import Exemplar
    from mitex.mesh import Mesh
    from mitex.paths import prepare_output

    for mesh in MESHES:
        for suffix in (".glb", ".png"):
            prepare_output(out / f"{Path(mesh).stem}{suffix}")
    out = prepare_output(out / "demo.png").parent
    exemplar = Exemplar.load(EXEMPLAR)
    texture = _fit(exemplar, out / "run", seed, steps, say)
    files, pictures = [], []
    for source in MESHES:
        mesh = Mesh.load(source)
        say(f"{mesh.name}: growing the texture, baking, rendering")
        asset = texture.apply(mesh, seed=seed, resolution=RESOLUTION)
        picture = _picture(asset)
        pictures.append(picture)
        files += [asset.export(out / f"{mesh.name}.glb"), _write(out / f"{mesh.name}.png", picture)]
    return [*files, _write(out / "demo.png", _side_by_side(exemplar, pictures))]


def _fit(exemplar: Exemplar, run: Path, seed: int, steps: int, say: Callable[[str], None]) -> NcaTexture:
    from mitex.methods import nca
    from mitex.training.locate import CHECKPOINT, PREVIOUS

    resume = any((run / name).is_file() for name in (CHECKPOINT, PREVIOUS))
    start = "the run in the folder" if resume else f"model '{PARENT}'"
    say(f"learning '{exemplar.name}', {steps} steps, starting from {start}")
    milestones = f"{round(0.6 * steps)},{round(0.85 * steps)}"
    overrides = [f"seed={seed}", f"steps={steps}", *SETTINGS, f"milestones={milestones}"]
    return nca.fit(exemplar, run, overrides=overrides, resume=resume, init=None if resume else PARENT)


def _picture(asset: Asset) -> np.ndarray:
    from mitex.render import still, tone

    return tone(still(asset, resolution=SIZE, spp=SAMPLES))


def _side_by_side(exemplar: Exemplar, pictures: list[np.ndarray]) -> np.ndarray:
    import numpy as np

    return np.concatenate([exemplar.resized(SIZE).maps["albedo"], *pictures], axis=1)


def _write(path: Path, picture: np.ndarray) -> Path:
    from mitex.images import write_image

    return write_image(path, picture)
