"""One name for one thing, at the command line and in Python."""

import inspect
from dataclasses import fields
from importlib import import_module

import pytest

from mitex.cli.render import Render
from mitex.export import embossed
from mitex.methods import nca
from mitex.methods.geometric.animation import Animate
from mitex.methods.registry import methods
from mitex.render import film, still, turntable
from mitex.render.picture import render_still
from mitex.render.shell import shell_still
from mitex.training.settings import RunOptions

# What only the command line has, for what is another call or another argument in Python.
FIT_ONLY = {"quiet", "settings", "tile"}
APPLY_ONLY = {
    "model",
    "out",
    "quiet",
    "maps_format",
    "remesh",
    "vertex_colours",
    "variants",
    "tile",
    "tile_cells",
}
FILM_ONLY = {
    "model",
    "out",
    "quiet",
    "mesh",
    "meshes",
    "remesh",
    "seed",
    "to_seed",
    "field",
    "placement",
    "start_level",
    "end_level",
}


def names(command: type) -> set[str]:
    return {field.name for field in fields(command)}


def parameters(*functions) -> set[str]:
    return {name for function in functions for name in inspect.signature(function).parameters}


@pytest.mark.parametrize("name", methods())
class TestMethod:
    def test_fit(self, name):
        method = methods()[name]
        package = import_module(method.texture.partition(":")[0].rpartition(".")[0])
        fits = [getattr(package, call) for call in ("fit", "fit_text") if call in package.__all__]
        fit = fits[0]
        assert "out" in parameters(fit) and inspect.signature(fit).parameters["out"].default is None
        settings = names(type(next(iter(method.load_presets().values()))))
        # One command may learn from an exemplar or from words, which are two calls in Python.
        told = parameters(*fits) | RunOptions.__annotations__.keys() | settings
        assert names(method.load_fit()) - told <= FIT_ONLY

    def test_apply(self, name):
        method = methods()[name]
        # An asset, its relief as geometry and a living page are calls of their own in Python.
        pages = (nca.living_page,) if name == "nca" else ()
        told = parameters(method.load_texture().apply, embossed, shell_still, *pages)
        assert names(method.load_apply()) - told <= APPLY_ONLY


def test_pictures_and_films():
    assert names(Render) - parameters(still, turntable, render_still) == {"out", "quiet"}
    assert names(Animate) - parameters(film) <= FILM_ONLY
