"""The bundled models are those of the tool's table."""

import pytest

from mitex.methods.nca import METHOD, NcaTexture
from mitex.methods.registry import bundled
from tools.make_models import MODELS, PARENT, RECIPES, record

OF_A_RUN = {"seconds", "family", "loss", "maps", "palette", "growth_steps"}


def test_every_bundled_rule_is_in_the_table():
    assert set(bundled(METHOD)) == set(RECIPES)
    assert {recipe.parent for recipe in RECIPES.values()} <= {None, *RECIPES} and PARENT in RECIPES


@pytest.mark.parametrize("name", RECIPES)
def test_a_bundled_rule_was_trained_as_the_table_says(name):
    about = NcaTexture.load(MODELS / f"{name}.safetensors").about
    assert {key: value for key, value in about.items() if key not in OF_A_RUN} == record(name)
