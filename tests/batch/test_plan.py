"""Plans that cannot be run: code 2, one line, and nothing is written."""

import errno
import json
import os
from pathlib import Path

import pytest

from mitex.batch import Plan
from mitex.batch.jobs import jobs_of
from mitex.cli import main

GOOD = """exemplars = ["a.png"]
meshes = ["m.obj"]
[methods.stripes]
steps = 2
"""

# Name -> (the plan, words of the message)
PLANS = {
    "empty": ("", "no methods"),
    "not TOML": ("exemplars = = 3", "not valid TOML"),
    "not text": (b"\xff\xfe\0", "not valid TOML"),
    "unknown method": (
        GOOD.replace("stripes", "strypes"),
        "there is no method 'strypes'; did you mean stripes?",
    ),
    "unknown key": ('exemplar = ["a.png"]\n' + GOOD, "no key 'exemplar'; did you mean exemplars?"),
    "unknown option": (GOOD + "widht = 3.0", "methods.stripes has no key 'widht'; did you mean width?"),
    "unknown option of apply": (GOOD + "[methods.stripes.apply]\nturm = 3.0", "did you mean turn?"),
    "what the plan says itself": (GOOD + 'out = "x"', "methods.stripes has no key 'out'"),
    "a text for a list": (GOOD.replace('["a.png"]', '"a.png"'), "exemplars of the plan cannot be 'a.png'"),
    "a text for a number": (GOOD + 'depth = "low"', "depth cannot be 'low'"),
    "a number for an option's text": (GOOD + "salt = 3", "salt of methods.stripes cannot be 3; give a text"),
    "out of range": (GOOD + "width = 99.0", "width = 99 is out of range"),
    "a seed out of range": ("seeds = [-1]\n" + GOOD, "seed -1 is out of range"),
    "unknown output": ('output = "fbx"\n' + GOOD, "output of the plan cannot be 'fbx'"),
    "a text besides those that are its exemplars": (
        GOOD + 'source = "salt"\nsalt = "pepper"',
        "methods.stripes has 'salt' besides its exemplars; leave out `salt`",
    ),
    "fits alone that are put on meshes": (
        'output = "none"\n' + GOOD + "[methods.stripes.apply]\nturn = 3.0",
        "methods.stripes is only fit, and has options of `mitex apply`",
    ),
    "a name for a folder": (
        'exemplars = ["lava"]\n[methods.plain_field]',
        "there is no exemplar 'lava'; paths are relative",
    ),
    "no table": ('exemplars = ["a.png"]\nmethods = 3', "methods of the plan cannot be 3"),
    "a method that is no table": (
        'exemplars = ["a.png"]\n[methods]\nstripes = 3',
        "methods.stripes cannot be 3",
    ),
    "no exemplars": ("[methods.stripes]", "methods.stripes has no exemplars"),
    "no meshes for a method that needs one": ('exemplars = ["a.png"]\n[methods.inlay]', "inlay needs meshes"),
    "missing exemplar": (
        GOOD.replace("a.png", "no.png"),
        "there is no exemplar 'no.png'; paths are relative",
    ),
    "misspelt name": (GOOD.replace("a.png", "lafa"), "there is no exemplar 'lafa'"),
    "misspelt reference": (
        'exemplars = ["spkes"]\nmeshes = ["m.obj"]\n[methods.displacement]',
        "there is no exemplar 'spkes'; paths are relative",
    ),
    "misspelt reference that is named as the source": (
        'exemplars = ["spkes"]\nmeshes = ["m.obj"]\n[methods.geometric]\nsource = "reference"',
        "there is no exemplar 'spkes'; paths are relative",
    ),
    "an exemplar for a reference": (
        'exemplars = ["lava"]\nmeshes = ["m.obj"]\n[methods.geometric]',
        "or name one of spikes, scales, ",
    ),
    "misspelt model": ('exemplars = ["lafa"]\nmeshes = ["m.obj"]\n[methods.quilted]', "no exemplar 'lafa'"),
    "missing mesh": (GOOD.replace("m.obj", "no.obj"), "there is no mesh 'no.obj'"),
    "pattern without a match": (GOOD.replace("a.png", "*.jpg"), "no exemplar is called '*.jpg'"),
    "device": (GOOD.replace("a.png", "/dev/zero"), "'/dev/zero' is neither a file nor a folder"),
    "duplicate jobs": (GOOD.replace('"a.png"', '"a.png", "a.png"'), "the job fit-stripes-a twice"),
    "of an unknown one": (GOOD + 'of = "strypes"', "which is not before it in the plan"),
    "of itself": (GOOD + 'of = "stripes"', "'stripes', which is not before it in the plan"),
    "of one that learns from a mesh": (
        GOOD + '[methods.inlay]\n[methods.b]\nmethod = "stripes"\nof = "inlay"',
        "'inlay', which does not learn from exemplars alone",
    ),
    "of one and of a mesh": (GOOD + '[methods.inlay]\nof = "stripes"', "'stripes' and from something else"),
    "of one with other seeds": (
        GOOD + '[methods.b]\nmethod = "stripes"\nof = "stripes"\nseeds = [3]',
        "'stripes', with other exemplars or seeds",
    ),
    "null byte": (GOOD.replace("a.png", "a\\u0000.png"), "there is no exemplar"),
}


@pytest.fixture
def check(workshop, monkeypatch, capsys):
    """Runs a plan that must be refused."""
    monkeypatch.chdir(workshop.folder)

    def check(message, words="plan.toml --out out"):
        before = tree(workshop.folder)
        assert main(["batch", *words.split(), "--quiet"]) == 2
        printed = capsys.readouterr()
        assert printed.err.startswith("error: ") and printed.err.count("\n") == 1 and not printed.out
        assert message in printed.err and "; " in printed.err
        assert tree(workshop.folder) == before

    return check


def tree(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def write(workshop, content: str | bytes = GOOD) -> None:
    data = content if isinstance(content, bytes) else content.encode()
    (workshop.folder / "plan.toml").write_bytes(data)


@pytest.mark.parametrize("name", PLANS)
def test_broken_plans(name, workshop, check):
    content, message = PLANS[name]
    write(workshop, content)
    check(message)


def test_a_comparison_of_what_is_no_reference(workshop, monkeypatch, capsys):
    monkeypatch.chdir(workshop.folder)
    words = "compare --exemplar lava --mesh vase --methods displacement --out out --quiet"
    assert main(words.split()) == 2
    printed = capsys.readouterr().err
    assert "there is no exemplar 'lava'; " in printed and printed.count("\n") == 1
    assert not (workshop.folder / "out").exists()


class TestPlanFiles:
    def test_missing(self, check):
        check("there is no such file")

    def test_a_folder(self, workshop, check):
        (workshop.folder / "plan.toml").mkdir()
        check("it is no file")

    def test_huge(self, workshop, check):
        with (workshop.folder / "plan.toml").open("wb") as file:
            file.truncate(1 << 40)
        check("more than 1 MB")

    def test_a_huge_exemplar(self, workshop, check):
        with (workshop.folder / "a.png").open("wb") as file:
            file.truncate(1 << 40)
        write(workshop)
        check("more than 8 GB")


class TestPlaces:
    @pytest.fixture(autouse=True)
    def good_plan(self, workshop):
        write(workshop)

    def test_unwritable(self, check, monkeypatch):
        monkeypatch.setattr(os, "access", lambda path, mode: False)
        check("not writable")

    def test_a_file(self, check):
        check("is a file", "plan.toml --out a.png")

    @pytest.mark.parametrize("name", ["thesis.txt", "plan.jsonl"])
    def test_not_ours(self, name, workshop, check):
        (workshop.folder / "out").mkdir()
        (workshop.folder / "out" / name).write_text('{"id": 3}\n')
        check("'out' holds other files")

    @pytest.mark.parametrize("moment", ["fsync", "replace"])
    def test_a_full_disk(self, moment, check, monkeypatch):
        def refuse(*_, **__):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr(os, moment, refuse)
        check("no space left")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("plan.toml --out out --jobs 0", "--jobs 0"),
        ("plan.toml --out out --threads 0", "--threads 0"),
        ("plan.toml --out out --engine ray", "--engine"),
        ("plan.toml --out out --address tcp://x:1", "add --engine dask"),
        ("plan.toml --out out --engine dask --address tcp://x:1 --jobs 2", "contradict"),
        ("plan.toml --out out --engine dask --address=", "scheduler is empty; name one"),
        ("plan.toml --out out --slurm time=3", "add --engine slurm"),
        ("plan.toml --out out --engine slurm --slurm time", "write KEY=VALUE"),
        ("plan.toml --out out --engine dask --address tcp://127.0.0.1:1", "no Dask scheduler answers"),
    ],
)
def test_options(words, message, workshop, check, monkeypatch):
    monkeypatch.setattr("mitex.batch.engines.dask_cluster.PATIENCE", 0.3)
    write(workshop)
    check(message, words)


def test_status_of_another_folder(workshop, capsys):
    assert main(["batch", "status", str(workshop.folder)]) == 2
    assert "is no folder of `mitex batch`" in capsys.readouterr().err


@pytest.mark.parametrize(
    "change", [{"result": 5}, {"words": "fit"}, {"needs": [1]}, {"about": {"method": ["a"]}}, {"more": 1}]
)
def test_status_of_a_plan_that_is_none(change, workshop, capsys):
    record = jobs_of(workshop.plan())[0].record()
    (workshop.folder / "plan.jsonl").write_text(json.dumps(record))
    assert main(["batch", "status", str(workshop.folder)]) == 0
    for text in (json.dumps(record | change), "[" * 100_000):
        (workshop.folder / "plan.jsonl").write_text(text)
        assert main(["batch", "status", str(workshop.folder)]) == 2
        assert "is no folder of `mitex batch`" in capsys.readouterr().err


def test_a_good_plan(workshop):
    write(workshop)
    (part,) = Plan.read(workshop.folder / "plan.toml").methods
    assert (part.label, part.method, part.output, part.fit) == ("stripes", "stripes", "glb", {"steps": 2})
