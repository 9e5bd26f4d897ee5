"""Which options name files, by their types alone: those of a method that is installed from outside."""

import pytest

from mitex.batch import Plan
from mitex.batch.jobs import jobs_of
from mitex.errors import ConfigError


@pytest.fixture
def fit(workshop):
    """The fit of a plan of one method."""

    def fit(method="glaze", **table):
        content = {"exemplars": ["cobalt"], "meshes": ["m.obj"], "methods": {method: table}}
        return jobs_of(Plan.of(content, workshop.folder))[0]

    return fit


def value_of(job, option):
    return job.words[job.words.index(f"--{option}") + 1]


@pytest.mark.parametrize(
    ("option", "value", "is_file"),
    [
        ("poem", "blue.png", False),
        ("preset", "plain", False),
        ("finish", "matte", False),
        ("finish", "blue.png", True),
        ("drip", "up", False),
        ("drip", "1,0,0", False),
        ("drip", "down.NPY", True),
        ("mask", "blue.png", True),
        ("kiln", "north", True),
    ],
)
def test_its_type_says_whether_a_text_is_a_file(option, value, is_file, fit, workshop):
    """Where there is one of that name, whose content the job is known by then; elsewhere nothing is."""
    assert value_of(fit(**{option: value}), option) == value
    ids = set()
    for content in "12":
        (workshop.folder / value).write_text(content)
        job = fit(**{option: value})
        ids.add(job.id)
        assert value_of(job, option) == (str(workshop.folder / value) if is_file else value)
    assert len(ids) == 1 + is_file


def test_the_option_knows_the_names_that_may_stand_for_files(fit, workshop):
    assert value_of(fit(exemplars=["copper"]), "colour") == "copper"
    with pytest.raises(ConfigError, match="there is no exemplar 'koper'.*name one of cobalt, copper"):
        fit(exemplars=["koper"])
    (workshop.folder / "koper").touch()
    assert value_of(fit(exemplars=["koper"]), "colour") == str(workshop.folder / "koper")


def test_words_that_it_learns_from_are_no_files(fit, workshop):
    (workshop.folder / "copper").touch()
    assert value_of(fit(source="poem", exemplars=["copper"]), "poem") == "copper"
    for option in ("kiln", "finish"):
        assert value_of(fit(source=option, exemplars=["copper"]), option) == str(workshop.folder / "copper")


def test_what_is_no_text_is_not_learned_from(fit):
    with pytest.raises(ConfigError, match="source of methods.stripes cannot be 'steps'"):
        fit("stripes", source="steps")
