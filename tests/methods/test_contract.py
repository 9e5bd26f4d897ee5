"""What every method keeps: the built-in ones, the baselines, and one that is registered from outside."""

import json
import subprocess
import sys
import threading
import tomllib
from dataclasses import fields, replace
from functools import partial
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
import torch

import mitex
from mitex.cli import commands, main
from mitex.cli.usage import parse
from mitex.errors import CheckpointError
from mitex.images import read_image
from mitex.lazy import load as resolve_reference
from mitex.methods.option_types import may_be_file
from mitex.methods.options import ApplyOptions, FitOptions
from mitex.methods.registry import load, method_of, methods
from mitex.training import checkpoint, model_file
from mitex.training.locate import NAME
from mitex.training.settings import FitConfig, meaning
from tests.methods.fits import FITS, coarse_grids, few_patches, prepare, rough_surfaces, small_coarse_fields
from tests.state import in_thread, program_state

SIDE = 48  # of pictures [pixels]
TOY = Path(__file__).parents[1] / "toy"
pytestmark = pytest.mark.usefixtures("own_cache", "toy", "quick_settling", "quick_beginnings", "known_hulls")


@pytest.fixture(scope="module")
def toy():
    """The toy method is installed: its folder is on the path, with its entry point."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(TOY)
        methods.cache_clear()
        yield methods()["checkerboard"]
    methods.cache_clear()


@pytest.fixture(scope="module")
def quick_beginnings():
    """What fits begin with is made by other fits, which have settings of their own."""
    with pytest.MonkeyPatch.context() as patch:
        small_coarse_fields(patch, rays=512, table=11, occupancy=32)
        rough_surfaces(patch)
        yield


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("contract")
    prepare(folder)
    return folder


@pytest.fixture(scope="module")
def runs(workplace, toy, own_cache, quick_beginnings):
    """Run folders of tiny fits, made when they are asked for."""
    folders = {}

    def run(name):
        if FITS[name].source:
            run(FITS[name].source)
        if name not in folders:
            with pytest.MonkeyPatch.context() as patch:
                patch.chdir(workplace)
                words = f"--out runs/{name} --quiet {FITS[name].fit}".split()
                command, before = parse(methods()[name].load_fit(), words, "fit"), program_state()
                command.run()
                assert program_state() == before
            folders[name] = workplace / "runs" / name
        return folders[name]

    return run


def test_every_method_is_tried(toy):
    assert set(FITS) == set(methods())


def test_no_method_is_loaded_before_it_is_used():
    """What the command line knows of methods costs neither torch nor Mitsuba nor NumPy."""
    code = (
        "import sys; from mitex.methods.registry import methods; print(len(methods()));"
        "print({'torch', 'mitsuba', 'drjit', 'numpy', 'tyro'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    count, heavy = done.stdout.split("\n", 1)
    assert int(count) == len(FITS) - 1 and heavy.strip() == "set()"


def test_baselines_come_last_and_say_so(toy):
    flags = [method.baseline for method in methods().values()]
    assert flags == sorted(flags) and methods()["displacement"].baseline


def test_an_installed_method_cannot_take_a_built_in_one_s_name(monkeypatch, toy):
    from mitex.methods import registry

    monkeypatch.setattr(registry, "_installed", lambda: iter([replace(toy, name="nca")]))
    methods.cache_clear()
    assert methods()["nca"].title != toy.title
    methods.cache_clear()


def test_a_method_brings_commands_but_takes_no_shared_one(toy, monkeypatch):
    own = ("mitex.cli.doctor:Doctor", "a line")
    checkers = replace(toy, commands={"checkers": own, "render": own, "apply": own})
    monkeypatch.setattr(commands, "methods", lambda: {"checkerboard": checkers})
    assert commands.of_methods() == {"checkers": own} and commands.lines()["checkers"] == "a line"
    assert commands.find(["checkers"]).command.__name__ == "Doctor"


def python_fit(name, **options):
    """The fit of the words in Python, where the names are the same; not yet called."""
    method = methods()[name]
    command = parse(method.load_fit(), FITS[name].fit.split(), "fit")
    fit = import_module(method.texture.partition(":")[0].rpartition(".")[0] or "checkerboard").fit
    inputs = {key: getattr(command, key) for key in signature(fit).parameters if hasattr(command, key)}
    return partial(fit, **(inputs | {"out": None}), **command.run_options(), **options)


@pytest.mark.parametrize("name", ["checkerboard", "displacement"])
def test_a_fit_in_memory_gives_the_texture_of_the_run_folder(name, runs, workplace, tmp_path, monkeypatch):
    run = runs(name)
    monkeypatch.chdir(workplace)
    files = set(workplace.rglob("*"))
    texture = python_fit(name)()
    assert set(workplace.rglob("*")) == files and type(texture) is methods()[name].load_texture()
    (expected, _), (actual, _) = map(model_file.read, (run / NAME, texture.save(tmp_path / NAME)))
    assert expected.keys() == actual.keys()
    assert all(torch.equal(value, expected[key]) for key, value in actual.items())


def test_a_fit_that_computes_in_one_go_is_cancelled_before(runs, workplace, monkeypatch, toy):
    monkeypatch.chdir(workplace)
    stop = threading.Event()
    stop.set()
    with pytest.raises(mitex.Cancelled):
        python_fit("displacement", cancel=stop)()


def test_settings_by_name(workplace, monkeypatch, toy):
    fit = import_module("checkerboard").fit
    exemplar, heard = mitex.Exemplar.load("lava"), []
    fit(exemplar, steps=3, seed=5, set={"cell": 0.5}, on_step=heard.append)
    assert heard[-1].steps == 3
    with pytest.raises(mitex.ConfigError, match="steps is set to 4 and to 3; give it once"):
        fit(exemplar, steps=3, set=["steps=4"])
    with pytest.raises(mitex.ConfigError, match="no key 'sell'; did you mean cell"):
        fit(exemplar, set={"sell": 0.5})


def test_another_variant_gets_what_works_or_an_error(mi, workplace, monkeypatch, toy):
    monkeypatch.chdir(workplace)
    mesh, texture = mitex.Mesh.load("cube.obj"), load("pebbles")
    asset = texture.apply(mesh, steps=1, subdivide=1, resolution=None)
    mi.set_variant("llvm_ad_mono")  # has arrays, but no colours
    again = texture.apply(mesh, steps=1, subdivide=1, resolution=None)
    assert np.array_equal(again.maps["albedo"], asset.maps["albedo"])
    with pytest.raises(mitex.ConfigError, match="'llvm_ad_mono', which is in use; call mitsuba.set_variant"):
        asset.render("a.png", resolution=16, spp=1)
    mi.set_variant("scalar_rgb")
    for call in (
        lambda: texture.apply(mesh, steps=1, subdivide=1),
        lambda: asset.render("a.png", resolution=16, spp=1),
        python_fit("checkerboard"),
    ):
        with pytest.raises(
            mitex.ConfigError, match="'scalar_rgb', which is in use; call mitsuba.set_variant"
        ):
            call()
    assert asset.export("a.ply").is_file() and mi.variant() == "scalar_rgb"


@pytest.mark.parametrize("name", FITS)
class TestDescription:
    def test_its_references_lead_somewhere(self, name):
        method = methods()[name]
        assert method.name == name and method.title
        assert issubclass(method.load_fit(), FitOptions) and issubclass(method.load_apply(), ApplyOptions)
        texture = method.load_texture()
        assert all(hasattr(texture, attribute) for attribute in ("load", "save", "apply"))
        assert method.animate is None or callable(resolve_reference(method.animate).run)
        for reference, line in method.commands.values():
            assert callable(resolve_reference(reference).run) and line

    def test_the_default_config_is_the_first_preset_and_every_key_is_explained(self, name):
        presets = methods()[name].load_presets()
        config = type(next(iter(presets.values())))
        assert issubclass(config, FitConfig) and config() == next(iter(presets.values()))
        assert all(key == preset.preset and type(preset) is config for key, preset in presets.items())
        assert all(meaning(config, one) for one in fields(config))

    def test_its_help_has_examples_of_itself(self, name):
        method = methods()[name]
        assert f"mitex fit {name} " in (method.load_fit().__doc__ or "")
        assert "mitex apply " in (method.load_apply().__doc__ or "")

    def test_batches_are_told_what_it_takes(self, name):
        method, options = methods()[name], {field.name for field in fields(methods()[name].load_fit())}
        assert f"--{method.learns_from} " in FITS[name].fit.replace("-", "_").replace("__", "--")
        assert method.fits_to_mesh == ("--mesh " in FITS[name].fit)
        assert method.applies_to_meshes == ("--mesh " in FITS[name].apply)
        assert method.resumes == bool(FITS[name].resume)
        assert method.load_fit().only_at_start <= options
        preset = get_type_hints(method.load_fit(), include_extras=True)["preset"]
        assert not may_be_file("paper", preset)

    def test_its_settings_are_listed(self, name, capsys):
        assert main(["fit", name, "--settings"]) == 0
        assert capsys.readouterr().out.startswith("preset = ")


@pytest.mark.parametrize("name", FITS)
class TestRun:
    def test_the_run_folder_tells_its_method_and_holds_a_texture(self, name, runs):
        folder = runs(name)
        content = tomllib.loads((folder / "config.toml").read_text())
        assert content["run"]["method"] == name and "mitex" in content["versions"]
        assert method_of(folder) == method_of(folder / NAME) == methods()[name]

    def test_a_texture_survives_saving(self, name, runs, tmp_path):
        texture = load(runs(name))
        again = load(texture.save(tmp_path / "copy.safetensors"))
        assert type(again) is type(texture) is methods()[name].load_texture()
        assert json.dumps(dict(again.about)) == json.dumps(dict(texture.about))
        assert again.about["name"] and again.about["preset"]

    def test_files_of_others_are_refused(self, name, runs):
        other = "displacement" if name != "displacement" else "checkerboard"
        with pytest.raises(CheckpointError):
            methods()[name].load_texture().load(runs(other) / NAME)
        with pytest.raises(CheckpointError):
            methods()[name].load_texture().load("no such model")

    def test_it_is_applied_exported_and_rendered(self, name, runs, workplace, monkeypatch, capsys):
        monkeypatch.chdir(workplace)
        few_patches(monkeypatch)
        coarse_grids(monkeypatch)
        quick = {"resolution": SIDE, "spp": 4}
        monkeypatch.setattr(methods()[name].load_apply(), "picture_options", lambda options: quick)
        for suffix in ("glb", "png"):
            out = f"out/{name}.{suffix}"
            assert main(f"apply {runs(name)} --out {out} {FITS[name].apply}".split()) == 0
            assert capsys.readouterr().out.splitlines()[-1] == out
        assert (workplace / f"out/{name}.glb").read_bytes()[:4] == b"glTF"
        picture = read_image(workplace / f"out/{name}.png")
        assert picture.shape == (SIDE, SIDE, 3) and picture.std() > 0.02

    def test_an_option_of_another_method_is_refused(self, name, runs, capsys):
        assert main(["apply", str(runs(name)), "--no-such-option", "--out", "a.glb"]) == 2
        assert f"no option of {name} textures" in capsys.readouterr().err

    def test_a_run_is_not_overwritten(self, name, runs, workplace, monkeypatch, capsys):
        monkeypatch.chdir(workplace)
        before = (runs(name) / NAME).read_bytes()
        assert main(f"fit {name} --out runs/{name} --quiet {FITS[name].fit}".split()) == 2
        assert "holds a" in capsys.readouterr().err and (runs(name) / NAME).read_bytes() == before

    def test_in_memory_it_is_cancelled_and_writes_nothing(self, name, runs, workplace, tmp_path, monkeypatch):
        """In a thread that is not the main one. `nerf` is cancelled in the coarse field that comes first."""
        if not FITS[name].resume:
            pytest.skip("a method that does not train")
        monkeypatch.chdir(workplace)
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
        reports, stop = [], threading.Event()

        def on_step(progress):
            reports.append(progress)
            if progress.step:
                stop.set()

        fit = python_fit(name, on_step=on_step, cancel=stop)
        files, before = set(workplace.rglob("*")), program_state()
        with pytest.raises(mitex.Cancelled, match="after step 1; nothing has been kept"):
            in_thread(fit)
        assert [report.step for report in reports] == [0, 1] and reports[0].steps >= 2
        assert set(workplace.rglob("*")) == files and not list(tmp_path.iterdir())
        assert program_state() == before

    def test_it_is_resumed(self, name, runs, workplace, monkeypatch):
        if not FITS[name].resume:
            pytest.skip("a method that does not train")
        monkeypatch.chdir(workplace)
        before = load(runs(name)).about["steps"]
        words = f"fit {name} --out runs/{name} --quiet {FITS[name].fit} {FITS[name].resume}"
        words = words.replace("--steps 2", "", 1)
        assert main(words.split()) == 0
        assert load(runs(name)).about["steps"] == before + 1
        assert checkpoint.load(runs(name)).step == before + 1
