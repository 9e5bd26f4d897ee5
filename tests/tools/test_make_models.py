"""The bundled models are those of the tool's table."""

import pytest

from mitex.methods.nca import NcaTexture
from tools.make_models import EXEMPLARS, MODELS, PARENT, SETTINGS, record

OF_A_RUN = {"seconds", "loss", "maps"}


def test_every_bundled_rule_is_in_the_table():
    bundled = {path.stem for path in MODELS.glob("*.safetensors")} - {"scales", "spikes"}  # `geometric`
    assert bundled == set(EXEMPLARS) == set(SETTINGS)
    assert PARENT in EXEMPLARS


@pytest.mark.parametrize("name", EXEMPLARS)
def test_a_bundled_rule_was_trained_as_the_table_says(name):
    about = NcaTexture.load(MODELS / f"{name}.safetensors").about
    assert {key: value for key, value in about.items() if key not in OF_A_RUN} == record(name)
