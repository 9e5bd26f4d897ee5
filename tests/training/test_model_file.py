"""Model files: what a reader may find wrong with their tensors."""

import pytest
import torch
from safetensors.torch import save_file

from mitex.errors import CheckpointError
from mitex.mesh import Mesh
from mitex.training import model_file


def _saved(tmp_path, **tensors):
    return model_file.save(tmp_path / "texture.safetensors", tensors, "toy", {"name": "ball"})


def test_round_trip(tmp_path):
    path = _saved(tmp_path, values=torch.arange(3.0))
    with model_file.opened(path, "toy") as (tensors, about):
        assert tensors["values"].tolist() == [0, 1, 2] and about == {"name": "ball"}


def test_tensors_that_are_no_mesh_mean_a_damaged_file(tmp_path):
    path = _saved(tmp_path, vertices=torch.zeros(3, 3), faces=torch.tensor([[0, 1, 9]]))
    with (
        pytest.raises(CheckpointError, match="not a toy texture.*vertex 9"),
        model_file.opened(path, "toy") as (tensors, _),
    ):
        Mesh(tensors["vertices"].numpy(), tensors["faces"].numpy())


def test_a_file_of_another_method(tmp_path):
    path = _saved(tmp_path, values=torch.zeros(1))
    with (
        pytest.raises(CheckpointError, match="is not a other texture"),
        model_file.opened(path, "other"),
    ):
        pass


def test_a_tensor_without_elements_may_not_be_larger_than_its_file(tmp_path):
    """A network built beside it would ask for terabytes."""
    path = _saved(tmp_path, values=torch.zeros(0, 2**40))
    with pytest.raises(CheckpointError, match="larger than the file"), model_file.opened(path, "toy"):
        pass


@pytest.mark.parametrize(
    "about", ["[1]", '{"name": 1}', "{}", "null", "[" * 100_000, '{"name": Infinity}'], ids=range(6)
)
def test_descriptions_of_another_kind(tmp_path, about):
    metadata = {"format": "mitex-toy-1", "about": about}
    save_file({"values": torch.zeros(1)}, tmp_path / "a.safetensors", metadata)
    with pytest.raises(CheckpointError, match="a.safetensors.*not a toy"):  # noqa: SIM117
        with model_file.opened(tmp_path / "a.safetensors", "toy"):
            pass
