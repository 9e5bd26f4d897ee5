import pytest
import torch

from mitex.methods.nca.text.views import Figure
from mitex.scenes.shaded import GREY
from tests.methods.nca.text.tiny_text import grown, task


@pytest.fixture(scope="module")
def scene():
    """A figure, a look, a state of it, and cameras."""
    one = grown(task())
    return one.figures[one.meshes[0]], one.look, one.pool[0], one.banks[one.meshes[0]].sight(0).cameras


def test_the_background_is_white_and_the_rest_is_shaded(scene):
    figure, look, state, cameras = scene
    hit = figure.surface.stage.hits(cameras).hit.view(cameras.shape)
    bare, views = figure.bare(cameras), figure.textured(look, state, cameras)
    for picture in (bare, views.coloured, views.plain):
        assert picture.shape == (2, 24, 24, 3) and (picture[~hit] == 1).all()
    assert bare[hit].max() <= GREY and bare[hit].std() > 0.02
    assert not torch.equal(views.plain, bare)
    shade = views.plain[hit] / GREY
    assert torch.allclose(views.coloured[hit], shade * views.values[:, :3].clamp(0, 1), atol=1e-6)


def test_close_ups_are_as_wide_as_the_density():
    """Seen along the normals, nothing but the surface in them, and other ones for other seeds."""
    one = task("views=patch", "density=4", "view_count=3")
    cameras, other = (one.banks[one.meshes[0]].sight(index).cameras for index in (0, 1))
    assert (cameras.kind, len(cameras)) == ("orthographic", 3)
    assert cameras.half_width == pytest.approx(2 * one.meshes[0].edge)
    assert one.meshes[0].stage.hits(cameras).hit.all()
    assert not (cameras.origin == other.origin).any()


def test_the_relief_of_a_grey_picture_does_not_depend_on_colours(scene):
    figure, look, state, cameras = scene
    first = figure.textured(look, state, cameras)
    other = Figure(figure.surface, 0.0).textured(look, state, cameras)
    assert torch.allclose(other.plain, figure.bare(cameras), atol=1e-6)
    assert torch.equal(other.values, first.values)


@pytest.mark.parametrize("picture", ["coloured", "plain"])
def test_gradients_by_finite_differences(scene, picture):
    figure, look, state, cameras = scene
    generator = torch.Generator().manual_seed(1)
    weights, direction = torch.rand(2, 24, 24, 3, generator=generator), torch.zeros_like(state)
    direction[:40] = torch.randn(40, 16, generator=generator)

    def total(scale):
        return (getattr(figure.textured(look, state + scale * direction, cameras), picture) * weights).sum()

    (slope,) = torch.autograd.grad(total(scale := torch.zeros((), requires_grad=True)), scale)
    with torch.no_grad():
        difference = (total(1e-3) - total(-1e-3)) / 2e-3
    assert slope.item() == pytest.approx(difference.item(), rel=0.02)


def test_a_sight_is_drawn_from_its_settings():
    one = task("text_distances=3", "text_crops=4", "view_count=3")
    sight = one.banks[one.meshes[0]].sight(0)
    assert len(sight.whole.picture) == 3 and len(sight.close.picture) == 12
    assert torch.tensor(sight.cameras.origin).norm(dim=1).sub(3).abs().max() < 1e-5
