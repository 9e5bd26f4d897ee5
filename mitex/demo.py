"""`mitex demo`: what Mitex does, in a few minutes, without any input."""

from __future__ import annotations

import logging
import time
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.checks import in_range
from mitex.ranges import SEEDS

if TYPE_CHECKING:
    import numpy as np

    from mitex.asset import Asset
    from mitex.methods.surface import SurfaceTexture

log = logging.getLogger(__name__)

# Synthesized here and now: exemplar, mesh, maps.
EXEMPLAR, MESH = "hexagons", "vase"
MAPS = ("albedo", "height", "normal")
SETTINGS = ["steps=20", "milestones=13,17"]  # a third of the default, hard to tell from more
# Bundled models, and the meshes that they grow on.
MODELS = {"ceramic": "octopus", "lava": "knot", "cobblestone": "shaderball"}
RESOLUTION = 1024  # of what the models grow [texels]
SIZE, SAMPLES = 512, 40  # of the pictures


@dataclass
class Demo:
    """Synthesize a texture on a mesh, grow bundled ones on others, render and export; prints the files made.

    The sheet demo.png shows all of them beside the images that they were learned from. Calling the command
    again goes on where it was stopped.

    examples:
      mitex demo
      mitex demo --out /tmp/demo --seed 3
    """

    out: Annotated[Path, arg(metavar="DIR")] = Path("demo")
    """Folder for everything that is made."""

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        in_range("--seed", self.seed, *SEEDS)
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        start = time.monotonic()
        for path in demo(self.out, self.seed, self.quiet):
            print(path)
        log.info("done in %.0f s", time.monotonic() - start)


def demo(out: Path, seed: int, quiet: bool = False) -> list[Path]:
    """Synthesizes, grows, renders and exports into `out`.

    Args:
        out: folder; a synthesis that was stopped in it goes on.
        seed: of the synthesis and the models.
        quiet: show no progress of the synthesis.

    Returns:
        The files made: a .glb and a .png for each mesh, and the sheet of all pictures.

    Raises:
        MitexError: `out` is not usable, or Mitsuba is not.
    """
    from mitex.paths import prepare_output
    from mitex.render import sheet

    for mesh in (MESH, *MODELS.values()):
        for suffix in (".glb", ".png"):
            prepare_output(out / f"{mesh}{suffix}")
    out = prepare_output(out / "demo.png").parent
    log.info("synthesizing '%s' on %s", EXEMPLAR, MESH)
    pieces = [_put(_synthesized(out / "run", seed, quiet).apply(), EXEMPLAR, MESH, out)]
    for model, mesh in MODELS.items():
        log.info("growing '%s' on %s", model, mesh)
        pieces.append(_put(*_grown(model, mesh, seed), mesh, out))
    cells = [picture for piece in pieces for picture in (piece.exemplar, piece.picture)]
    labels = [label for piece in pieces for label in (f"image: {piece.source}", f"on {piece.mesh}")]
    picture = sheet(cells, columns=4, labels=labels, cell=SIZE)
    files = [file for piece in pieces for file in piece.files]
    return [*files, _write(out / "demo.png", picture)]


@dataclass(frozen=True, eq=False)
class Piece:
    """A texture on a mesh, as the sheet shows it.

    Attributes:
        source, mesh: names of what was learned from, and of the mesh.
        exemplar, picture: both as pictures (H, W, 3), sRGB in [0, 1].
        files: that were written.
    """

    source: str
    mesh: str
    exemplar: np.ndarray
    picture: np.ndarray
    files: list[Path]


def _synthesized(run: Path, seed: int, quiet: bool) -> SurfaceTexture:
    from mitex.exemplar import Exemplar
    from mitex.methods import surface
    from mitex.training.locate import has_checkpoint
    from mitex.training.progress import ProgressDisplay

    maps = Exemplar.load(EXEMPLAR).maps
    exemplar = Exemplar({name: maps[name] for name in MAPS}, EXEMPLAR)
    with nullcontext() if quiet else ProgressDisplay() as on_step:
        return surface.fit(
            exemplar, MESH, run, set=SETTINGS, seed=seed, resume=has_checkpoint(run), on_step=on_step
        )


def _grown(model: str, mesh: str, seed: int) -> tuple[Asset, str]:
    """A bundled model on a mesh, and the name of its exemplar."""
    from mitex.mesh import Mesh
    from mitex.methods.nca import NcaTexture

    texture = NcaTexture.load(model)
    return texture.apply(Mesh.load(mesh), seed=seed, resolution=RESOLUTION), str(texture.about["exemplar"])


def _put(asset: Asset, source: str, mesh: str, out: Path) -> Piece:
    """Renders and exports."""
    from mitex.exemplar import Exemplar
    from mitex.render import still, tone

    picture = tone(still(asset, resolution=SIZE, spp=SAMPLES))
    files = [asset.export(out / f"{mesh}.glb"), _write(out / f"{mesh}.png", picture)]
    return Piece(source, mesh, Exemplar.load(source).resized(SIZE).maps["albedo"], picture, files)


def _write(path: Path, picture: np.ndarray) -> Path:
    from mitex.images import write_image

    return write_image(path, picture)
