"""What every method keeps: the built-in ones, the baselines, and one that is registered from outside."""

import json
import subprocess
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from mitex.cli import main
from mitex.errors import CheckpointError
from mitex.images import read_image
from mitex.lazy import load as resolve_reference
from mitex.methods.options import ApplyOptions, FitOptions
from mitex.methods.registry import load, method_of, methods
from mitex.training import checkpoint
from mitex.training.locate import NAME
from mitex.training.settings import FitConfig, meaning
from tests.methods.fits import FITS, prepare

SIDE = 48  # of pictures [pixels]
TOY = Path(__file__).parents[1] / "toy"
pytestmark = pytest.mark.usefixtures("own_cache", "toy")


@pytest.fixture(scope="module")
def toy():
    """The toy method is installed: its folder is on the path, with its entry point."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(TOY)
        methods.cache_clear()
        yield methods()["checkerboard"]
    methods.cache_clear()


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("contract")
    prepare(folder)
    return folder


@pytest.fixture(scope="module")
def runs(workplace, toy, own_cache):
    """Run folders of tiny fits, made when they are asked for."""
    folders = {}

    def run(name):
        if FITS[name].source:
            run(FITS[name].source)
        if name not in folders:
            with pytest.MonkeyPatch.context() as patch:
                patch.chdir(workplace)
                words = f"fit {name} --out runs/{name} --quiet {FITS[name].fit}".split()
                assert main(words) == 0
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
    from dataclasses import replace

    from mitex.methods import registry

    monkeypatch.setattr(registry, "_installed", lambda: iter([replace(toy, name="nca")]))
    methods.cache_clear()
    assert methods()["nca"].title != toy.title
    methods.cache_clear()


@pytest.mark.parametrize("name", FITS)
class TestDescription:
    def test_its_references_lead_somewhere(self, name):
        method = methods()[name]
        assert method.name == name and method.title
        assert issubclass(method.load_fit(), FitOptions) and issubclass(method.load_apply(), ApplyOptions)
        texture = method.load_texture()
        assert all(hasattr(texture, attribute) for attribute in ("load", "save", "apply"))
        assert method.animate is None or callable(resolve_reference(method.animate).run)

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
