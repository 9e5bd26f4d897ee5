"""Trains the bundled models: the parent from scratch, the others from it, so that any two can be grafted.

The settings are those of the models that ship, as far as their files tell, which a test compares.

usage: python tools/make_models.py EXEMPLARS [NAME ...]

EXEMPLARS is a folder with one folder of maps per exemplar. Each model takes about 20 minutes on two cores;
its run folder under runs/models/ can be resumed by calling the script again.
"""

from __future__ import annotations

import sys
from pathlib import Path

from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods.nca import PRESETS, NcaTexture, fit
from mitex.render import still, tone
from mitex.training import checkpoint, resolve

RUNS = Path("runs/models")
MODELS = Path(__file__).parents[1] / "mitex" / "data" / "models"
PARENT = "waffle"
# The waffle's bars are coarse: fewer vertices to the exemplar leave more of them in a view.
SETTINGS = {
    "waffle": ("density=64", "resolution=80"),
    "pebbles": ("steps=1450", "milestones=1200,1400"),
    "bricks": ("steps=2050", "milestones=1800,1950"),
    "honeycomb": ("steps=900", "milestones=500,800"),
}
EXEMPLARS = {
    "waffle": "Waffle_001",
    "pebbles": "Pebbles_025",
    "bricks": "Bricks_Terracotta_003",
    "honeycomb": "Honeycomb_002",
}


def record(name: str) -> dict[str, object]:
    """What the file of a model trained by this table says of its training."""
    settings = resolve(PRESETS, overrides=SETTINGS[name])
    about: dict[str, object] = {"name": name, "exemplar": EXEMPLARS[name], "preset": settings.preset}
    about |= {"steps": settings.steps, "density": settings.density}
    return about if name == PARENT else about | {"parent": PARENT}


def train(name: str, exemplars: Path) -> NcaTexture:
    """Fits one model with the default preset, from the parent unless it is the parent."""
    run, child = RUNS / name, name != PARENT
    texture = fit(
        exemplars / EXEMPLARS[name],
        run,
        overrides=SETTINGS[name],
        init=MODELS / f"{PARENT}.safetensors" if child else None,
        resume=(run / checkpoint.NAME).is_file(),
    )
    return NcaTexture(texture.look, {**texture.about, "name": name})


def thumbnail(texture: NcaTexture, path: Path) -> None:
    """A 256 x 256 still of the texture on an embedded mesh."""
    picture = still(texture.apply(embedded("shaderball")), resolution=256, spp=128)
    write_image(path, tone(picture))


def main() -> None:
    exemplars = Path(sys.argv[1])
    for name in sys.argv[2:] or EXEMPLARS:
        texture = train(name, exemplars)
        texture.save(MODELS / f"{name}.safetensors")
        thumbnail(texture, MODELS / f"{name}.png")


if __name__ == "__main__":
    main()
