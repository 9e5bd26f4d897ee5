"""What a step of a training from words compares."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.losses import directional_distance, laplacian_excess, mean_direction, overflow_loss
from mitex.mesh import icosphere, torus
from mitex.methods.nca.text.task import TextTask
from mitex.methods.nca.text.wording import MAPS
from mitex.runtime import threads
from mitex.training.loop import train
from tests.methods.nca.text.tiny_text import MeanColour, config, grown, loss, task
from tests.training.contract import FAULTS, assert_loss_is_pure, assert_third_step_leaves_no_trace


@pytest.fixture(autouse=True)
def one_thread():
    threads(1)


@pytest.mark.parametrize("step", [0, 1])
def test_the_loss_changes_nothing(step):
    assert_loss_is_pure(grown(task()), step)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_skipped_step_leaves_every_byte(fault):
    assert_third_step_leaves_no_trace(lambda: grown(task()), config(), fault)


def test_the_grey_seed_is_at_no_distance_from_its_negative():
    """Its pictures are the negative's, pixel by pixel: the same cuts and tilts are done to both."""
    one = task("decoder=false", "channels=12")
    surface = one.meshes[0]
    state = torch.zeros(one.pool.shape[1:], requires_grad=True)
    terms = one.terms(surface, state, torch.Generator().manual_seed(0))
    assert [terms[name].item() for name in ("whole", "close", "relief")] == [1.0, 1.0, 1.0]
    torch.stack(list(terms.values())).sum().backward()
    assert state.grad is not None and state.grad.isfinite().all() and state.grad[:, :3].any()


def test_the_terms_are_those_of_the_paper():
    """Equations 7 to 9, picture by picture."""
    weights = "text_relief_weight=2", "text_range_weight=3", "text_smooth_weight=5"
    one = grown(task(*weights, "text_roughness=0.01"))
    surface, state, generator = one.meshes[0], one.pool[0], torch.Generator()
    terms = one.terms(surface, state, generator.manual_seed(5))
    index = int(torch.randint(3, (), generator=generator.manual_seed(5)))
    sight, figure, model = one.banks[surface].sight(index), one.figures[surface], MeanColour()
    views, bare = figure.textured(one.look, state, sight.cameras), figure.bare(sight.cameras)
    texts = model.encode_texts(["an image of a sphere made of red", "sphere"])

    def distance(pictures, augmentation):
        sides = (augmentation(side, 16) for side in (pictures, bare))
        directions = [mean_direction(torch.cat([model.encode_images(p[None]) for p in s])) for s in sides]
        return directional_distance(*directions, *texts).item()

    assert terms["whole"].item() == pytest.approx(distance(views.coloured, sight.whole), abs=1e-5)
    assert terms["close"].item() == pytest.approx(distance(views.coloured, sight.close), abs=1e-5)
    assert terms["relief"].item() == pytest.approx(2 * distance(views.plain, sight.close), abs=1e-5)
    edges = surface.mesh.edges
    rows, neighbours = (torch.tensor(array) for array in (edges.rows, edges.indices))
    excess = laplacian_excess(2 * views.height - 1, rows, neighbours, 0.01)
    assert terms["rough"].item() == pytest.approx(5 * excess.item(), rel=1e-5)
    assert terms["range"].item() == pytest.approx(3 * overflow_loss(2 * views.values - 1).item(), rel=1e-5)


def test_negatives_are_computed_once_and_equal_fresh_ones():
    one, again = task(), task()
    surface = one.meshes[0]
    first = one.banks[surface].negative(1)
    assert one.banks[surface].negative(1) is first and one.banks[surface].negative(2) is not first
    loss(grown(one))
    fresh = again.banks[again.meshes[0]].negative(1)
    assert torch.equal(fresh.whole, first.whole) and torch.equal(fresh.close, first.close)
    assert not torch.equal(one.banks[surface].negative(2).close, first.close)


def test_a_bank_holds_other_views_for_another_seed():
    one, same, other = task(), task(), task("seed=1")
    cameras = [t.banks[t.meshes[0]].sight(2).cameras.origin for t in (one, same, other)]
    assert np.array_equal(cameras[0], cameras[1]) and not np.array_equal(cameras[0], cameras[2])
    assert not np.array_equal(cameras[0], one.banks[one.meshes[0]].sight(0).cameras.origin)


def test_it_learns_a_colour():
    def colour(one):
        state = one.evolved(0, torch.zeros_like(one.grown(0)), 3, torch.Generator().manual_seed(0))[0]
        cameras = one.banks[one.meshes[0]].sight(0).cameras
        views = one.figures[one.meshes[0]].textured(one.look, state, cameras)
        return views.values[:, :3].mean(0)

    settings = ("steps=40", "inject_every=1", "pool=1", "lr=0.01")
    for text, channel in (("red", 0), ("green", 1)):
        one = task(*settings, text=text)
        before = colour(one)
        train(one, config(*settings, text=text), None, lr=0.01, normalise_gradients=True)
        change = (colour(one) - before).tolist()
        others = [change[k] for k in range(3) if k != channel]
        assert change[channel] > 0.1 + max(others), (text, change)
    assert one.look.maps == MAPS


def test_an_object_whose_name_nobody_knows():
    """Matters only where its name is read."""
    mesh = replace(icosphere(3), name="my_scan")
    plain = task("text_directional=false", "text_prompt={text}", mesh=mesh)
    assert plain.metadata()["text"] == "red"
    with pytest.raises(StopIteration):
        task("text_prompt={text}", mesh=mesh)


def test_texts_that_mean_the_same():
    with pytest.raises(
        ConfigError, match="'an image of a sphere made of sphere' means no more than 'sphere'"
    ):
        task(text="sphere")


def test_a_mesh_of_ones_own():
    """It is trained on in place of the spheres, in their size, and is what the prompt speaks of."""
    mesh = torus(12, 8)
    one = TextTask(config("text_object=none"), MeanColour(), mesh=mesh.with_vertices(7 * mesh.vertices))
    (surface,) = one.meshes
    assert np.linalg.norm(surface.mesh.vertices, axis=1).max() == pytest.approx(1.0, abs=1e-3)
    assert len(surface.mesh.vertices) >= 8000
    assert one.metadata()["mesh"] == mesh.name and "mesh_key" in one.metadata()
    assert one.metadata()["text"].startswith(f"an image of a {mesh.name} made of")


def test_previews_show_colours_and_relief():
    one = grown(task())
    preview = one.preview(4)
    assert preview.shape == (512, 512, 3) and preview.min() >= 0 and preview.max() == 1
    upper, lower = preview[:256], preview[256:]
    assert np.ptp(upper, axis=2).max() > 0.02 and np.ptp(lower, axis=2).max() < 1e-6
