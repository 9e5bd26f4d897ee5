"""From a plan to jobs: how many, in which order, with which commands, and what their ids follow from."""

import json
import shutil
import subprocess
import sys
import tomllib

import pytest
import tomli_w

from mitex.batch import Job, Plan
from mitex.batch.jobs import jobs_of
from mitex.errors import ConfigError
from mitex.features.text_model import EMBEDDED
from mitex.methods.surface.content import AO


@pytest.fixture
def jobs(workshop):
    """The jobs of a plan, which begins as one fit of a.png on m.obj."""

    def jobs(methods=None, **keys):
        content = {"exemplars": ["a.png"], "meshes": ["m.obj"], "methods": methods or {"stripes": {}}} | keys
        return jobs_of(Plan.of(content, workshop.folder))

    return jobs


def test_plans_do_not_load_torch():
    """Jobs do, in processes of their own."""
    code = """
import sys
from mitex.batch import Plan
from mitex.batch.jobs import jobs_of
methods = dict.fromkeys(("nca", "surface", "gatys", "text2mesh"), {})
jobs_of(Plan.of({"exemplars": ["lava"], "meshes": ["vase"], "methods": methods}))
sys.exit("torch" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_a_plan_that_is_written_down_is_the_same(workshop):
    """With all that a plan can say."""
    small = {"method": "stripes", "depth": 0.25, "salt": "x", "apply": {"turn": 3.0}, "output": "ply"}
    content = {"exemplars": ["a.png", "*.png"], "seeds": [0, 4], "meshes": ["m.obj"]}
    tables = {"small": small, "b": {"method": "stripes", "of": "small"}, "stripes": {"source": "salt"}}
    plan = Plan.of(content | {"methods": tables}, workshop.folder)
    text = tomli_w.dumps(plan.content())
    assert Plan.of(tomllib.loads(text), workshop.folder) == plan


def names(jobs):
    return [job.name for job in jobs]


class TestExpansion:
    def test_a_texture_for_any_mesh_is_learned_once(self, jobs, workshop):
        shutil.copy(workshop.folder / "m.obj", workshop.folder / "n.obj")
        fit, *applies = jobs(meshes=["m.obj", "n.obj"])
        assert names([fit, *applies]) == ["fit-stripes-a", "apply-stripes-a-m", "apply-stripes-a-n"]
        assert fit.needs is None and [job.needs for job in applies] == [fit.id] * 2
        assert all(job.words[1] == fit.result for job in applies)

    def test_a_fit_of_another_fit_waits_for_it(self, jobs):
        """For the same exemplar and seed; with other settings of the one, the other is another job."""
        methods = {"stripes": {}, "b": {"method": "stripes", "of": "stripes"}}
        every = jobs(methods, seeds=[0, 1])
        fits = {job.name: job for job in every if job.words[0] == "fit"}
        for seed in (0, 1):
            first, second = fits[f"fit-stripes-a-s{seed}"], fits[f"fit-b-a-s{seed}"]
            assert first.needs is None and second.needs == first.id
            assert second.words[second.words.index("--exemplar") + 1] == first.result
            assert second.resumed[second.resumed.index("--exemplar") + 1] == first.result
        (apply,) = (job for job in every if job.name == "apply-b-a-s1-m")
        assert apply.needs == fits["fit-b-a-s1"].id
        others = jobs({**methods, "stripes": {"steps": 3}}, seeds=[0, 1])
        assert not {job.id for job in others} & {job.id for job in every}

    def test_a_fit_that_needs_its_mesh_is_made_for_each(self, jobs, workshop):
        (workshop.folder / "n.obj").write_text("n")
        every = jobs({"inlay": {}}, meshes=["*.obj"])
        assert names(every) == ["fit-inlay-a-m", "apply-inlay-a-m", "fit-inlay-a-n", "apply-inlay-a-n"]
        assert [job.needs for job in every] == [None, every[0].id, None, every[2].id]

    def test_seeds_and_patterns(self, jobs):
        every = jobs(exemplars=["*.png"], seeds=[0, 7], meshes=[])
        assert names(every) == [f"fit-stripes-{name}-s{seed}" for name in "ab" for seed in (0, 7)]
        assert every[1].words[-4:-2] == ("--seed", "7")

    def test_a_method_has_its_own_lists_and_another_name(self, jobs):
        every = jobs({"wide": {"method": "stripes", "width": 2.5, "exemplars": ["b.png"]}, "stripes": {}})
        assert names(every)[::2] == ["fit-wide-b", "fit-stripes-a"]
        assert every[0].words[-4:-2] == ("--set", "width=2.5") and every[0].words[1] == "stripes"

    def test_fits_alone(self, jobs, workshop):
        """Also of methods that are fit to a mesh, or whose textures need none."""
        tables = {"stripes": {}, "inlay": {}, "plain_field": {"exemplars": ["captured"]}}
        (workshop.folder / "captured").mkdir()
        fits = ["fit-stripes-a", "fit-inlay-a-m", "fit-plain_field-captured"]
        assert names(jobs(tables, output="none")) == fits
        assert len(jobs(tables)) == 6

    def test_names_of_what_ships_with_mitex(self, jobs):
        fit, apply = jobs(exemplars=["lava"], meshes=["vase"])
        assert fit.words[3:5] == ("--exemplar", "lava") and "vase" in apply.words

    def test_methods_are_asked_what_they_learn_from(self, jobs):
        (fit, _) = jobs({"geometric": {"exemplars": ["spikes"], "steps": 3}})
        assert fit.words[:7] == ("fit", "geometric", "--quiet", "--reference", "spikes", "--steps=3", "--out")


class TestCommands:
    def test_options_settings_and_outputs(self, jobs, workshop):
        (workshop.folder / "salt").mkdir()
        fit, apply = jobs(
            {"stripes": {"steps": 3, "salt": "salt", "depth": 0.25, "apply": {"turn": -4.5}}}, output="maps"
        )
        folder = workshop.folder
        assert fit.words == (
            *("fit", "stripes", "--quiet", "--exemplar", f"{folder}/a.png", "--steps=3"),
            *("--salt", f"{folder}/salt", "--set", "depth=0.25", "--out", fit.result),
        )
        assert fit.resumed == tuple(
            word for word in (*fit.words, "--resume") if "salt" not in word.removeprefix(str(folder))
        )
        assert apply.words == (
            *("apply", fit.result, "--quiet", "--mesh", f"{folder}/m.obj", "--turn=-4.5"),
            *("--out", f"{apply.result}/m/"),
        )

    def test_words_that_begin_with_a_dash_are_one_with_their_option(self, jobs):
        fit, _ = jobs({"nca": {"source": "text"}}, exemplars=["-dark wood"])
        assert fit.words[:5] == ("fit", "nca", "--quiet", "--text=-dark wood", "--out")
        assert fit.resumed[3] == "--text=-dark wood" and fit.about["exemplar"] == "-dark wood"

    def test_names_and_words_stay_even_where_files_are_called_like_them(self, jobs, workshop):
        for name in ("paper", "bricks", "red bricks"):
            (workshop.folder / name).mkdir()
        texts = ["bricks", "red bricks", "v2.0 bricks?"]
        table = {"exemplars": texts, "meshes": ["vase"]}
        pictures = {"exemplars": ["lava"], "preset": "paper"}
        methods = {"nca": table | {"source": "text"}, "x_mesh": table, "gatys": pictures}
        *fits, last = jobs(methods, output="none")
        assert [fit.words[4] for fit in fits] == texts * 2
        assert last.words[last.words.index("--preset") + 1] == "paper"

    @pytest.mark.parametrize(
        ("method", "command", "option", "text"),
        [
            ("geometric", "fit", "device", "cpu"),
            ("geometric", "apply", "placement", "none"),
            ("geometric", "fit", "field", "about-y"),
            ("nca", "fit", "motion", "right"),
            ("nca", "apply", "orientation", "45"),
            ("nca", "apply", "field", "1,0,0"),
            ("nca", "apply", "maps_format", "exr"),
            ("nerf", "apply", "quilting", "plane"),
            ("nerf", "apply", "light", "own"),
            ("surface", "fit", "content", AO),
            ("surface", "fit", "clip", EMBEDDED),
        ],
    )
    def test_values_that_are_no_files_stay(self, method, command, option, text, jobs, workshop):
        """Where a file is called like them; one of another name is a path."""
        other = {"content": "other.png", "clip": "other"}.get(option, "other.npy")
        (workshop.folder / "photos").mkdir()
        for name in (text, other):
            (workshop.folder / name).touch()

        def word(value):
            sources = {"geometric": "spikes", "nerf": "photos"}
            table = {"exemplars": [sources.get(method, "a.png")], "meshes": ["m.obj"]}
            given = {option: value}
            every = jobs({method: table | (given if command == "fit" else {"apply": given})})
            words = next(job.words for job in every if job.words[0] == command)
            return words[words.index(f"--{option.replace('_', '-')}") + 1]

        assert word(text) == text
        if option in ("field", "motion", "orientation", "content", "clip"):
            assert word(other) == str(workshop.folder / other)

    @pytest.mark.parametrize(("value", "words"), [(True, ["--keep-uvs"]), (False, [])])
    def test_flags(self, jobs, value, words):
        fit, _ = jobs({"surface": {"exemplars": ["lava"], "meshes": ["vase"], "keep_uvs": value}})
        assert [word for word in fit.words if word.startswith("--keep")] == words

    @pytest.mark.parametrize(
        ("method", "own", "seeds"),
        [("nca", {}, ["--seed=7"]), ("nca", {"apply": {"seed": 3}}, ["--seed=3"]), ("surface", {}, [])],
    )
    def test_what_is_applied_with_a_seed_gets_that_of_the_fit(self, jobs, method, own, seeds):
        table = {method: {"exemplars": ["lava"], "meshes": ["vase"], **own}}
        _, apply = jobs(table, seeds=[7])
        assert [word for word in apply.words if word.startswith("--seed")] == seeds
        _, apply = jobs({method: {"exemplars": ["lava"], "meshes": ["vase"]}})
        assert not [word for word in apply.words if word.startswith("--seed")]

    def test_records_come_back(self, jobs):
        for job in jobs(seeds=[3]):
            assert Job.of_record(json.loads(json.dumps(job.record()))) == job


class TestIds:
    """A job is known by all that its result follows from, and by nothing else."""

    def test_the_same_files_elsewhere_are_the_same_job(self, jobs, workshop):
        before = jobs()
        moved = workshop.folder / "moved"
        moved.mkdir()
        for name in ("a.png", "m.obj"):
            (workshop.folder / name).rename(moved / name)
        assert [job.id for job in jobs(exemplars=["moved/a.png"], meshes=["moved/m.obj"])] == [
            job.id for job in before
        ]

    @pytest.mark.parametrize("kind", ["setting", "option", "exemplar", "mesh", "seed", "version"])
    def test_what_changes_it(self, kind, jobs, workshop, monkeypatch):
        before = [job.id for job in jobs()]
        table, keys = {}, {}
        match kind:
            case "setting":
                table = {"width": 2.0}
            case "option":
                table = {"salt": "x"}
            case "exemplar":
                (workshop.folder / "a.png").write_text("other")
            case "mesh":
                (workshop.folder / "m.obj").write_text("other")
            case "seed":
                keys = {"seeds": [1]}
            case "version":
                monkeypatch.setattr("mitex.batch.jobs.__version__", "9")
        after = [job.id for job in jobs({"stripes": table}, **keys)]
        changed = [old != new for old, new in zip(before, after, strict=True)]
        assert changed == ([False, True] if kind == "mesh" else [True, True])

    def test_a_folder_is_known_by_names_and_contents(self, jobs, workshop):
        maps = workshop.folder / "maps"
        maps.mkdir()
        (maps / "x").write_text("1")
        ids = set()
        for change in ("", "2", "rename"):
            if change == "rename":
                (maps / "x").rename(maps / "y")
            else:
                (maps / "x").write_text(change)
            ids.add(jobs(exemplars=["maps"])[0].id)
        assert len(ids) == 3

    def test_models_that_the_environment_names_count(self, jobs, workshop, monkeypatch):
        """A CLIP model for words, and VGG-19's weights where it is asked for."""
        file = workshop.folder / "weights"
        monkeypatch.setenv("MITEX_VGG19", str(file))
        monkeypatch.setattr("mitex.features.text_model.model_folder", lambda: file)
        tables = {
            "words": {"method": "nca", "source": "text", "exemplars": ["moss"]},
            "named": {"method": "nca", "source": "text", "exemplars": ["moss"], "clip": "words"},
            "gatys": {"network": "vgg19", "exemplars": ["lava"]},
            "other": {"method": "gatys", "exemplars": ["lava"]},
            "surface": {"weights": "vgg19", "exemplars": ["lava"], "meshes": ["vase"]},
        }
        ids = []
        for content in ("1", "2"):
            file.write_text(content)
            ids.append([job.id for job in jobs(tables, output="none")])
        assert [old != new for old, new in zip(*ids, strict=True)] == [True, False, True, False, True]
        file.unlink()  # which only the machine that fits must have
        assert len(jobs({"gatys": tables["gatys"]}, output="none")) == 1

    def test_the_same_job_twice_is_refused(self, jobs):
        with pytest.raises(ConfigError, match="the job fit-stripes-a twice"):
            jobs(exemplars=["a.png", "./a.png"])
