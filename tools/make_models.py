"""Trains the bundled models: the parent from scratch, the others from it, so that any two can be grafted.

The settings are those of the models that ship, as far as their files tell, which a test compares.

usage: python tools/make_models.py EXEMPLARS [NAME ...]

EXEMPLARS is a folder with one folder of maps per exemplar. The parent takes 15 minutes on two cores, each
other model ten to twelve; its run folder under runs/models/ can be resumed by calling the script again.
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
from mitex.training import resolve
from mitex.training.locate import has_checkpoint

RUNS = Path("runs/models")
MODELS = Path(__file__).parents[1] / "mitex" / "data" / "models"
PARENT = "ceramic"
LONG = ("steps=700", "milestones=450,600", "density=48")  # from the parent


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
    settings: tuple[str, ...] = LONG


FINE = (*LONG[:2], "density=64")  # patterns that are small in their exemplar
SMALL = ("view_count=8",)  # exemplars of 128 pixels have one zoom, so more views of it
RECIPES = {
    PARENT: Recipe("scales", None, ()),
    "bricks": Recipe("bricks"),
    "cobblestone": Recipe("cobblestone"),
    "fur": Recipe("Stylized_Fur_001", settings=(*LONG, *SMALL)),
    "hexagons": Recipe("hexagons"),
    "honeycomb": Recipe("Honeycomb_002", settings=(*FINE, *SMALL)),
    "knit": Recipe("knit", settings=FINE),
    "lava": Recipe("lava"),
    "leather": Recipe("leather", settings=FINE),
    "mosaic": Recipe("Abstract_008", settings=(*LONG, *SMALL)),
    "pebbles": Recipe("Pebbles_025", settings=(*FINE, *SMALL)),
    "planks": Recipe("planks"),
    "rust": Recipe("rust"),
    "shells": Recipe("Wall_Shells_001", settings=(*LONG, *SMALL)),
    "waffle": Recipe("Waffle_001", settings=(*LONG, *SMALL)),
    "wicker": Recipe("wicker"),
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
        resume=has_checkpoint(run),
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
