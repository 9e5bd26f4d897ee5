"""Single steps of a synthesis: what a skipped one leaves, what a loss may change, diffusion and previews."""

import pytest
import torch

from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.task import VIEW, SurfaceTask
from mitex.runtime import threads
from mitex.training import resolve
from tests.methods.surface.small import small_task
from tests.training.contract import FAULTS, assert_loss_is_pure, assert_third_step_leaves_no_trace

pytestmark = pytest.mark.usefixtures("own_cache", "known_exemplars")
DIFFUSION = "diffusion=0.01"  # so that `commit` changes the texels in every step


@pytest.mark.parametrize("fault", FAULTS)
def test_a_skipped_step_leaves_every_byte(mesh, exemplar, fault):
    threads(1)
    config = small_task(mesh, exemplar, DIFFUSION).config
    assert_third_step_leaves_no_trace(lambda: small_task(mesh, exemplar, DIFFUSION), config, fault)


@pytest.mark.parametrize("setting", ["loss=gram", "loss=transport"])
def test_the_loss_changes_nothing(mesh, exemplar, setting):
    threads(1)
    assert_loss_is_pure(small_task(mesh, exemplar, setting), 1)


def test_diffusion_falls_with_the_learning_rate(mesh, exemplar):
    task = small_task(mesh, exemplar, DIFFUSION, "milestones=2,4", "layers=relu1_1")
    start, moved = task.coordinates.detach().mul(0.1), {}
    for step in (0, 1, 2, 5):
        with torch.no_grad():
            task.coordinates.copy_(start)
        task.loss(step, torch.Generator()).commit()
        moved[step] = task.coordinates.detach() - start
    assert moved[0].abs().max() > 1e-4 and torch.equal(moved[0], moved[1])
    for step, share in ((2, 0.5), (5, 0.25)):
        assert torch.allclose(moved[step], share * moved[0], atol=1e-6)


def test_previews_show_the_mesh_beside_the_exemplar(mesh, exemplar):
    task = small_task(mesh, exemplar)
    values = torch.zeros(len(task.coordinates), task.channels)
    values[:, task.layout["albedo"][0]] = 1.0
    with torch.no_grad():
        task.coordinates.copy_(task.space.coordinates(values))
    picture = task.preview(3)
    assert picture.shape == (3 * VIEW, 3 * VIEW, 3)  # colours, normals and the grey maps in turn
    sphere = picture[VIEW // 2, VIEW + VIEW // 2]
    assert sphere[0] > 0.9 and (sphere[1:] < 1e-4).all()
    assert (picture[0, VIEW] == 1).all()


def test_the_scale_becomes_finer():
    task = object.__new__(SurfaceTask)
    task.config = resolve(PRESETS, None, None, ["steps=100", "scales=2", "coarse_share=0.4"])
    assert [task.scale(k) for k in (0, 19, 20, 39, 40, 99)] == [2, 2, 1, 1, 0, 0]
    costs = [task.cost(k) for k in (0, 20, 40)]
    assert costs == pytest.approx([0.1 + 1 / 16, 0.1 + 1 / 4, 1.1])
