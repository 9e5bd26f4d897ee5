"""Trains the bundled models: the parent from scratch, the others from it, so that any two can be grafted.

The settings are those of the models that ship, as far as their files tell, which a test compares.

usage: python tools/make_models.py EXEMPLARS [NAME ...]

EXEMPLARS is a folder with one folder of maps per exemplar. Each model takes about 20 minutes on two cores;
its run folder under runs/models/ can be resumed by calling the script again.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from mitex.exemplar import names as exemplar_names
from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods.nca import PRESETS, NcaTexture, fit
from mitex.render import still, tone
from mitex.training import checkpoint, resolve

RUNS = Path("runs/models")
MODELS = Path(__file__).parents[1] / "mitex" / "data" / "models"
PARENT = "ceramic"
SHORT = ("steps=350", "milestones=200,290")  # enough from the parent
# The settings before there was a decoder, of the models that have not been trained anew.
UNDECODED = (
    *("decoder=false", "sphere=even", "aggregation=sum", "order_weight=0", "overflow_weight=1e4"),
    *("frequency=48", "min_steps=20", "max_steps=32", "zooms=1", "view_count=8", "resolution=64"),
    *("density=96", "exemplar_size=128", "pooling=average", "steps=1000", "milestones=750,900"),
    "layers=relu1_1,relu1_2,relu2_1,relu2_2,relu3_1,relu3_2,relu3_3,relu4_3,relu5_3",
)


@dataclass(frozen=True)
class Recipe:
    """How a model is trained.

    Attributes:
        exemplar: name of an embedded one, or of a folder in EXEMPLARS.
        parent: the model that it starts from.
        settings: other than the default preset's.
    """

    exemplar: str
    parent: str | None = PARENT
    settings: tuple[str, ...] = SHORT


RECIPES = {
    PARENT: Recipe("scales", None, ()),
    "cobblestone": Recipe("cobblestone"),
    "lava": Recipe("lava"),
    # The waffle's bars are coarse: fewer vertices to the exemplar leave more of them in a view.
    "waffle": Recipe("Waffle_001", None, (*UNDECODED, "density=64", "resolution=80")),
    "pebbles": Recipe("Pebbles_025", "waffle", (*UNDECODED, "steps=1450", "milestones=1200,1400")),
    "bricks": Recipe("Bricks_Terracotta_003", "waffle", (*UNDECODED, "steps=2050", "milestones=1800,1950")),
    "honeycomb": Recipe("Honeycomb_002", "waffle", (*UNDECODED, "steps=900", "milestones=500,800")),
}


def record(name: str) -> dict[str, object]:
    """What the file of a model trained by this table says of its training."""
    recipe = RECIPES[name]
    settings = resolve(PRESETS, overrides=recipe.settings)
    about: dict[str, object] = {"name": name, "exemplar": recipe.exemplar, "preset": settings.preset}
    about |= {"steps": settings.steps, "density": settings.density}
    return about | ({"parent": recipe.parent} if recipe.parent else {})


def train(name: str, exemplars: Path) -> NcaTexture:
    """Fits one model with the default preset, from its parent if it has one."""
    recipe, run = RECIPES[name], RUNS / name
    embedded_one = recipe.exemplar in exemplar_names()
    texture = fit(
        recipe.exemplar if embedded_one else exemplars / recipe.exemplar,
        run,
        set=recipe.settings,
        init=MODELS / f"{recipe.parent}.safetensors" if recipe.parent else None,
        resume=(run / checkpoint.NAME).is_file(),
    )
    return NcaTexture(texture.look, {**texture.about, "name": name})


def thumbnail(texture: NcaTexture, path: Path) -> None:
    """A 256 x 256 still of the texture on an embedded mesh."""
    picture = still(texture.apply(embedded("shaderball")), resolution=256, spp=128)
    write_image(path, tone(picture))


def main() -> None:
    exemplars = Path(sys.argv[1])
    for name in sys.argv[2:] or RECIPES:
        texture = train(name, exemplars)
        texture.save(MODELS / f"{name}.safetensors")
        thumbnail(texture, MODELS / f"{name}.png")


if __name__ == "__main__":
    main()
