"""The table of variants on the page of plugins, against the plugins."""

from pathlib import Path

import pytest

from mitex import plugins
from mitex.errors import ConfigError
from mitex.plugins import init
from mitex.runtime.jit import dr, mi
from tests.docs.plugins import PLUGINS, fog

init()

PAGE = Path(__file__).parents[2] / "docs" / "plugins.md"
# As their tests went on a graphics card, which most machines lack: `pytest --variant cuda_ad_rgb`.
CUDA = {
    **dict.fromkeys(PLUGINS, "yes"),
    "shell_field": "yes",
    "decoded_field": "no",
}


def table() -> dict[str, dict[str, str]]:
    """What the page says, by plugin and variant."""
    rows = [line.strip("| ").split(" | ") for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    (_, *variants), _, *lines = rows
    return {
        name.strip("`"): dict(zip(variants, cells, strict=True))
        for names, *cells in lines
        for name in names.split(", ")
    }


def texture(name: str) -> str:
    field = mi.load_dict({"type": name, **PLUGINS[name].properties()})
    si = dr.zeros(mi.SurfaceInteraction3f)
    for lookup in (field.eval_1, field.eval_3, field.eval_1_grad):
        lookup(si)
    try:
        field.eval(si)
    except ConfigError as e:
        assert "colours need an rgb or mono variant" in str(e)
        return "only roughness, normals, bumps"
    return "yes"


def image(integrator: str, field: dict) -> None:
    sensor = {"type": "perspective", "film": {"type": "hdrfilm", "width": 1, "height": 1}}
    scene = mi.load_dict({"type": "scene", "ball": {"type": "sphere"}, "sensor": sensor})
    mi.load_dict({"type": integrator, "field": field}).render(scene, evaluate=False)


def motion(_: str) -> str:
    image("motion", {"type": "vertex_field", **PLUGINS["vertex_field"].properties()})
    return "yes"


def feature(_: str) -> str:
    image("feature", {"type": "vertex_field", **PLUGINS["vertex_field"].properties()})
    try:
        image("feature", {"type": "checkerboard"})
    except ConfigError as e:
        assert "does not image Mitsuba's own textures" in str(e)
        return "only Mitex's fields"
    return "yes"


def shell(name: str) -> str:
    mi.load_dict({"type": name.removesuffix("_field"), "field": fog()})
    return "yes"


LOOK = {"feature": feature, "motion": motion, "shell": shell, "lit_shell": shell, "shell_field": shell}


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_mono", "llvm_ad_spectral", "scalar_rgb"])
def test_the_page_says_which_plugin_works_in_which_variant(variant):
    mi.set_variant(variant)
    column = "scalar" if variant.startswith("scalar") else variant
    for name, cells in table().items():
        try:
            works = LOOK.get(name, texture)(name)
        except (ConfigError, RuntimeError) as e:
            assert f"does not work in the variant '{variant}'" in str(e)
            works = "no"
        assert cells[column] == works, name


def test_polarized_variants_are_as_those_without():
    mi.set_variant("llvm_ad_mono_polarized")
    for name, cells in table().items():
        if cells["llvm_ad_mono"] == "yes":
            assert LOOK.get(name, texture)(name) == "yes"


def test_the_page_has_all_plugins_and_what_they_do_on_graphics_cards():
    registered = {module.__name__.rpartition(".")[2] for module in plugins.PLUGINS}
    assert set(table()) == {*registered, "shell_field"} and registered == set(PLUGINS)
    assert {name: cells["cuda"] for name, cells in table().items()} == CUDA
