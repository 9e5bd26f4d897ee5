"""From the command line's lists to jobs; what cannot be compared is refused: code 2, one line, no file."""

from dataclasses import asdict, replace

import pytest

from mitex.batch import Plan
from mitex.batch.jobs import jobs_of
from mitex.cli import main
from mitex.comparison.kinds import KINDS
from mitex.comparison.plan import comparison_plan, prepared
from mitex.comparison.presets import preset_plan, presets
from mitex.errors import ConfigError
from mitex.methods.baselines.quilted.elevations import FLAT
from mitex.methods.registry import methods

GOOD = {"--exemplar": "a.png", "--mesh": "ball.obj", "--methods": "image-quilting", "--out": "out"}

# Methods without presets of their own -> what is published of them
AS_PUBLISHED = {
    "quilted": {key: asdict(FLAT["2D as published"])[key] for key in ("even", "relit")},
}

# Name -> (changed options, words of the message)
BROKEN = {
    "no exemplar": ({"--exemplar": None}, "--exemplar is missing"),
    "no mesh": ({"--mesh": None}, "--mesh is missing"),
    "no methods": ({"--methods": ","}, "has no methods"),
    "an unknown method": ({"--methods": "image-qilting"}, "no method 'image_qilting'; did you mean image_"),
    "a method twice": ({"--methods": "gatys,gatys"}, "method 'gatys' is named twice"),
    "methods of two kinds": (
        {"--methods": "gatys,geometric"},
        "gatys learns from exemplar, and geometric from reference",
    ),
    "a plain field and a method for pictures": (
        {"--methods": "gatys,plain-field"},
        "gatys learns from exemplar, and plain_field from capture",
    ),
    "a plain field of an exemplar": (
        {"--exemplar": "lava", "--methods": "plain-field"},
        "there is no exemplar 'lava'",
    ),
    "a plain field on a mesh": (
        {"--methods": "plain-field", "--set": "plain-field:apply.density=2"},
        "plain_field is only fit, and has options of `mitex apply`",
    ),
    "a study of one method and a plain field": (
        {"--methods": "nerf,plain-field", "--study": ""},
        "a study of one method that is put on meshes asks nothing",
    ),
    "methods of a kind without measures": (
        {"--methods": "quilted"},
        "that learn from a texture are not compared",
    ),
    "an exemplar that does not exist": ({"--exemplar": "no.png"}, "there is no exemplar 'no.png'"),
    "a mesh that does not exist": ({"--mesh": "no.obj"}, "there is no mesh 'no.obj'"),
    "an exemplar twice": ({"--exemplar": "a.png a.png"}, "the job fit-image_quilting-a-s0 twice"),
    "no setting": ({"--set": "block"}, "'block' is not a setting"),
    "a setting of another method": ({"--set": "gatys:steps=3"}, "of no method that is compared"),
    "an unknown setting": ({"--set": "image-quilting:blok=3"}, "no key 'blok'; did you mean block"),
    "a setting out of range": ({"--set": "image-quilting:block=1"}, "block = 1 is out of range"),
    "an option of apply that is no number": (
        {"--set": "image-quilting:apply.scale=big"},
        "scale of image_quilting cannot be 'big'; give a finite number",
    ),
    "a key of plans": (
        {"--set": "image-quilting:method=gatys"},
        "'method' belongs to plans; write it into a plan",
    ),
    "a table of plans": ({"--set": "image-quilting:apply=x"}, "'apply' belongs to plans"),
    "a study of one method": ({"--study": ""}, "a study of one method that is put on meshes asks nothing"),
    "no seeds": ({"--seeds": "0"}, "--seeds 0 is out of range"),
    "a folder of something else": ({"--out": "."}, "'.' holds other files"),
    "data without a preset": ({"--data": "."}, "--data means nothing without --preset"),
    "an address without Dask": ({"--address": "tcp://a:1"}, "--address means nothing without Dask"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_comparisons(name, place, capsys):
    changes, message = BROKEN[name]
    options = {key: value for key, value in (GOOD | changes).items() if value is not None}
    before = sorted(place.rglob("*"))
    words = [word for key, value in options.items() for word in (key, *value.split())]
    assert main(["compare", *words, "--quiet"]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("error: ") and printed.err.count("\n") == 1 and not printed.out
    assert message in printed.err and "; " in printed.err
    assert sorted(place.rglob("*")) == before


def test_each_method_is_fit_as_often_as_it_must_be(place):
    """For any mesh at once, or for each; with every seed."""
    bundled = ["vase", "octopus"]
    plan = comparison_plan(["a.png", "lava"], bundled, ["nca", "multi-view-gram"], seeds=2)
    fits = [job for job in jobs_of(plan) if job.needs is None]
    applied = [job for job in jobs_of(plan) if job.needs is not None]
    of = {name: sum(job.about["method"] == name for job in fits) for name in ("nca", "multi_view_gram")}
    assert of == {"nca": 4, "multi_view_gram": 8}
    assert len(applied) == 16


def test_settings_reach_fit_and_apply(place):
    settings = ["nca:steps=7", "nca:preset=paper", "nca:apply.resolution=256", "nca:layers=relu1_1,relu2_1"]
    fit, applied = jobs_of(comparison_plan(["lava"], ["vase"], ["nca"], settings=settings))
    words = " ".join(fit.words)
    assert "--steps=7" in words and "--preset paper" in words and "layers=relu1_1,relu2_1" in words
    assert "--resolution=256" in applied.words


def test_a_plain_field_is_fit_alone_and_for_equal_time_if_that_is_asked_for(place, monkeypatch):
    (place / "photos").mkdir()
    plan = comparison_plan(["photos"], ["vase"], ["plain_field"], settings=["plain-field:seconds=600"])
    (fit,) = jobs_of(plan)
    assert fit.words[:2] == ("fit", "plain_field") and "seconds=600" in fit.words
    assert prepared(Plan.of(plan.content(), place)) == plan
    monkeypatch.setitem(KINDS, "capture", replace(KINDS["capture"], meshless=False))
    with pytest.raises(ConfigError, match="textures of plain_field are put on no mesh"):
        prepared(plan)


def test_patterns_are_as_large_for_all_unless_their_size_is_given(place):
    def words(*settings):
        plan = comparison_plan(["lava"], ["vase"], ["nca", "gatys"], settings=settings)
        return [" ".join(job.words) for job in jobs_of(plan) if job.needs is not None]

    nca, gatys = words()
    assert "--exemplar-width=0.5" in nca and "--exemplar-width" not in gatys
    assert "--exemplar-width=0.3" in words("nca:apply.exemplar-width=0.3")[0]
    assert "--exemplar-width" not in words("nca:apply.scale=2")[0]


class TestPlanFiles:
    def test_a_plan_and_its_seeds(self, place):
        (place / "plan.toml").write_text(
            'exemplars = ["a.png"]\nmeshes = ["ball.obj"]\nseeds = [5]\n[methods.gatys]\nsteps = 3\n'
        )
        plan = Plan.read("plan.toml")
        assert prepared(plan).methods[0].seeds == (5,)
        assert prepared(plan, seeds=2).methods[0].seeds == (0, 1)

    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ("--plan no.toml", "there is no such file"),
            ("--preset nca-fog10", "there is no comparison 'nca-fog10'; did you mean nca-fig10?"),
            ("--preset nca-fig10 --mesh vase", "the comparison has no mesh 'vase'"),
            ("--preset nca-fig10 --plan a.toml", "--plan and --preset contradict each other"),
            ("--preset nca-fig10", "exemplars/Abstract_008'; paths are relative to '{place}'"),
            ("--preset nca-fig10 --data no", "exemplars/Abstract_008'; paths are relative to '{place}/no'"),
        ],
    )
    def test_broken_ones(self, words, message, place, capsys):
        assert main(["compare", *words.split(), "--out", "out", "--quiet"]) == 2
        assert message.format(place=place) in capsys.readouterr().err
        assert not (place / "out").exists()

    def test_a_plan_without_meshes(self, place):
        plan = Plan.of({"exemplars": ["lava"], "methods": {"nca": {"output": "glb"}}}, place)
        with pytest.raises(ConfigError, match="there are no meshes to compare on; name some"):
            prepared(plan)

    @pytest.mark.parametrize("name", presets())
    def test_the_papers_comparisons_have_jobs(self, name, tmp_path):
        plan = preset_plan(name, tmp_path)
        for part in plan.methods:
            for text in (*part.exemplars, *part.meshes):
                if "/" in text:
                    (tmp_path / text).parent.mkdir(exist_ok=True)
                    (tmp_path / text).touch()
        assert len(jobs_of(prepared(plan))) > 20

    @pytest.mark.parametrize("name", presets())
    def test_published_settings_are_those_of_all_methods_or_of_none(self, name, tmp_path):
        """Beside the short forms; ours are not compared at length with baselines that are cut short."""
        short, published, labels = set(), set(), set()
        for part in preset_plan(name, tmp_path).methods:
            is_published = "paper" in part.fit.get("preset", "") or AS_PUBLISHED.get(part.method) == part.fit
            assert not is_published or part.of is None or part.of in labels
            labels |= {part.label} if is_published else set()
            (published if is_published else short).add((part.method, part.source))
        assert short
        assert published == {(method, source) for method, source in short if _has_published_form(method)}


def _has_published_form(method):
    """A displacement map needs no training, and some defaults are as published."""
    default, *others = methods()[method].load_presets().values()
    published = [one for one in others if "paper" in one.preset]
    return method in AS_PUBLISHED or any(replace(one, preset=default.preset) != default for one in published)
