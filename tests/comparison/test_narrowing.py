"""A part of a plan: its own exemplars, meshes and methods, with other settings; and each preset, run so."""

import csv
import re
from dataclasses import replace
from importlib import import_module

import pytest

from mitex.batch import Plan
from mitex.batch.jobs import jobs_of
from mitex.cli import main
from mitex.comparison.narrowing import narrowed
from mitex.comparison.plan import prepared
from mitex.comparison.presets import presets
from mitex.errors import ConfigError
from mitex.mesh import icosphere
from tests.cli import bad_files as bad
from tests.comparison.conftest import small_capture, write_mesh
from tests.methods.fits import FITS, coarse_grids
from tests.methods.nca.text.tiny_text import SETTINGS as TEXT_SETTINGS

CONTENT = {
    "exemplars": ["looks/a.png", "lava"],
    "meshes": ["ball.obj", "vase"],
    "seeds": [3],
    "methods": {
        "gatys": {"size": 64},
        "gatys_paper": {"method": "gatys", "preset": "paper", "apply": {"resolution": 256}},
        "image_quilting": {"meshes": ["vase"]},
    },
}
WORDS = "resolution=32 view=32 width=8 frequencies=4 views=1 text_vertices=50 preview_every=0 steps=2"
SETTINGS = {  # beside those of the tiny fits
    "nca text": " ".join((*TEXT_SETTINGS, "clip=words", "steps=2", "apply.resolution=64 apply.subdivide=0")),
    "text2mesh text": WORDS,
    "x_mesh text": WORDS,
    "geometric": "apply.start_level=0 apply.remesh=100",
    "nca": "apply.resolution=64 apply.steps=2 apply.subdivide=0",
    "reaction_diffusion": "apply.resolution=64 apply.steps=2",
    "solid_texture": "apply.resolution=64",
    "gatys": "apply.resolution=64",
    "image_quilting": "apply.resolution=64",
    "nerf": "base_mesh=base.obj apply.size=128 apply.density=200",
    "nerf_tex": "apply.density=200 apply.scale=0.25 apply.spacing=2",
    "quilted": "apply.resolution=128",
}
PARTS = {  # of each preset: exemplar, mesh, methods
    "geometric-fig11": ("spikes", "knot", "geometric displacement"),
    "nca-fig10": (
        "exemplars/Waffle_001",
        "spot",
        "nca reaction_diffusion solid_texture text2mesh gatys",
    ),
    "nca-fig11": ("red bricks", "vase", "nca text2mesh x_mesh"),
    "nerf-table2": ("durian", "vase", "nerf nerf_tex quilted plain_field"),
    "surface-fig4": (
        "rust",
        "vase",
        "surface multi_view_gram style_mesh solid_texture image_quilting gatys",
    ),
}


@pytest.fixture
def plan(place):
    (place / "looks").mkdir()
    (place / "a.png").rename(place / "looks" / "a.png")
    return Plan.of(CONTENT)


def named(plan):
    return {part.label: (part.exemplars, part.meshes) for part in plan.methods}


def test_what_is_not_narrowed_is_as_it_was(plan):
    assert jobs_of(prepared(narrowed(plan))) == jobs_of(prepared(plan))


def test_some_of_it_by_name(plan):
    part = narrowed(plan, exemplars=["a"], meshes=["vase"], labels=["image-quilting", "gatys-paper"])
    assert named(part) == {
        "gatys_paper": (("looks/a.png",), ("vase",)),
        "image_quilting": (("looks/a.png",), ("vase",)),
    }
    assert {job.id for job in jobs_of(prepared(part))} < {job.id for job in jobs_of(prepared(plan))}
    assert named(narrowed(plan, exemplars=["looks/a.png"]))["gatys"] == (
        ("looks/a.png",),
        ("ball.obj", "vase"),
    )


def test_its_methods_with_other_settings(plan):
    own = ["gatys_paper:steps=7", "gatys-paper:apply.resolution=64", "gatys:size=32"]
    first, second, _ = narrowed(plan, settings=own).methods
    assert first.fit["size"] == "32" and "steps" not in first.fit
    assert (second.fit["preset"], second.fit["steps"], second.apply["resolution"]) == ("paper", 7, 64)


def test_a_label_may_have_a_dash(place):
    labels = {name: {"method": "gatys"} for name in ("small-one", "small_one", "large_one")}
    plan = Plan.of({**CONTENT, "exemplars": ["lava"], "methods": labels})
    part = narrowed(plan, labels=["small-one", "large-one"], settings=["small-one:size=32"])
    assert [(part.label, part.fit) for part in part.methods] == [
        ("small-one", {"size": "32"}),
        ("large_one", {}),
    ]


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ({"exemplars": ["lav"]}, "has no exemplar 'lav'; did you mean lava?"),
        ({"meshes": ["cow"]}, "has no mesh 'cow'"),
        ({"labels": ["nca"]}, "has no method 'nca'"),
        ({"labels": ["image_quilting"], "meshes": ["ball"]}, "has no mesh 'ball'"),
        ({"settings": ["nca:steps=2"]}, "'nca:steps=2' is of no method that is compared"),
        ({"settings": ["gatys:apply.resolution=x"]}, "resolution of gatys cannot be 'x'"),
    ],
)
def test_what_a_plan_does_not_have(plan, part, message):
    with pytest.raises(ConfigError, match=re.escape(message)):
        narrowed(plan, **part)


def test_inputs_of_one_name_are_named_in_full(plan):
    plan = Plan.of({**CONTENT, "exemplars": ["x/t.png", "y/t.png", "z/lava.png", "lava"]})
    with pytest.raises(ConfigError, match=r"more than one exemplar 't'; name x/t.png or y/t.png"):
        narrowed(plan, exemplars=["t"])
    part = narrowed(plan, exemplars=["y/t.png", "lava"])
    assert named(part)["gatys"][0] == ("y/t.png", "lava")


def test_every_preset_is_run():
    assert set(PARTS) == set(presets())


@pytest.mark.usefixtures("small", "few_patches_of_relief", "planes_alike", "own_cache", "quick_settling")
@pytest.mark.parametrize("name", PARTS)
def test_a_preset_of_few_steps(name, place, monkeypatch):
    """All of its methods, from the command to the report, in which each has a row."""
    exemplar, mesh, methods = PARTS[name]
    files(place, monkeypatch)
    methods = methods.split()
    settings = [f"{method}:{word}" for method in methods for word in quick(name, method)]
    words = ["--preset", name, "--exemplar", exemplar, "--mesh", mesh, "--methods", ",".join(methods)]
    assert main(["compare", *words, "--set", *settings, "--out", "out", "--quiet"]) == 0
    with (place / "out" / "report.csv").open() as file:
        assert [row["method"] for row in csv.DictReader(file)] == methods


def files(place, monkeypatch):
    """What the presets name and does not ship with Mitex; a small ball stands in for meshes that do."""
    small_capture(place, monkeypatch)
    (place / "captures").mkdir()
    (place / "photos").rename(place / "captures" / "durian")
    (place / "exemplars" / "Waffle_001").mkdir(parents=True)
    bad.image(place / "exemplars" / "Waffle_001" / "albedo.png", (96, 96))
    (place / "meshes").mkdir()
    write_mesh(place / "meshes" / "spot.obj")
    coarse_grids(monkeypatch)
    monkeypatch.setattr("mitex.methods.geometric.references.FREQUENCY", 12)
    monkeypatch.setattr("mitex.methods.geometric.report.SAMPLES", 500)
    load = import_module("mitex.mesh.load")
    monkeypatch.setattr(load, "embedded", lambda name: replace(icosphere(6), name=name))


def quick(preset, method):
    """Settings of a tiny fit."""
    own = SETTINGS.get(method, "").split()
    if f"{method} text" in SETTINGS and preset == "nca-fig11":
        return SETTINGS[f"{method} text"].split()
    words = FITS[method].fit.split()
    steps = [f"steps={words[words.index('--steps') + 1]}"] if "--steps" in words else []
    return [*steps, *words[words.index("--set") + 1 :], *own]
