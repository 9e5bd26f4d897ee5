"""A run goes on with the inputs that it began with, or says which one is another."""

import pytest

from mitex.errors import CheckpointError
from mitex.training import train
from mitex.training.inputs import check_inputs
from tests.training.task import SmallConfig, SmallTask


class TaskOf(SmallTask):
    """With metadata of the test's."""

    def __init__(self, **metadata: str):
        super().__init__()
        self.texts = {"method": "small", **metadata}

    def metadata(self):
        return self.texts


def fit(folder, steps, resume=False, **metadata):
    train(TaskOf(**metadata), SmallConfig(steps=steps), folder, lr=0.01, resume=resume)


@pytest.fixture
def run(tmp_path):
    fit(tmp_path, 2, exemplar="photo", exemplar_key="12", mesh_key="ab")
    return tmp_path


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        (
            {"exemplar": "photo", "exemplar_key": "34"},
            "the exemplar 'photo' is not the one that",
        ),
        ({"exemplar": "photo", "mesh_key": "34"}, "the mesh is not the one that the run began with; resume"),
        ({"exemplar": "picture", "exemplar_key": "34"}, "made with exemplar 'photo', not 'picture'"),
    ],
)
def test_another_input_is_named(run, metadata, message):
    before = {path: path.read_bytes() for path in run.iterdir()}
    with pytest.raises(CheckpointError, match=message):
        fit(run, 3, resume=True, **metadata)
    assert {path: path.read_bytes() for path in run.iterdir()} == before


def test_what_a_checkpoint_does_not_tell_is_not_compared(run):
    fit(run, 3, resume=True, exemplar="photo", exemplar_key="12", template_key="cd")


def test_inputs_are_checked_before_there_is_a_task(run):
    check_inputs(run, {"exemplar": "photo", "exemplar_key": "12"})
    check_inputs(run / "elsewhere", {"exemplar_key": "34"})
    with pytest.raises(CheckpointError, match="exemplar"):
        check_inputs(run, {"exemplar_key": "34"})
    (run / "checkpoint.safetensors").rename(run / "checkpoint.previous.safetensors")
    with pytest.raises(CheckpointError, match="exemplar"):
        check_inputs(run, {"exemplar_key": "34"})
