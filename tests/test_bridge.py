"""The bridge: values and gradients against slow references, and clear errors at its limits."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.bridge import call, lookup, render
from mitex.errors import ConfigError
from mitex.features import Vgg16
from mitex.features.flow import lucas_kanade
from mitex.losses import gram_loss, gram_matrix, motion_loss, relaxed_transport
from mitex.mesh import Mesh, icosphere
from mitex.runtime.jit import dr
from mitex.runtime.upload import upload
from mitex.scenes import Cameras, random_views
from mitex.scenes.stage import Stage
from tests.scenes.helpers import gradient, live_variables
from tests.scenes.reference import images, matrix

AT_A_SLANT = 2e-5  # of float32 where a ray meets a slanted face; Embree takes each CPU's own instructions


@pytest.fixture
def mesh(rng) -> Mesh:
    ball = icosphere(3)
    return ball.with_vertices(ball.vertices * rng.uniform(0.85, 1.0, (len(ball.vertices), 1)))


@pytest.fixture
def field(mesh, rng) -> torch.Tensor:
    return torch.from_numpy(rng.uniform(-0.5, 1.5, (len(mesh.vertices), 4)).astype(np.float32))


def cameras(kind: str = "perspective", count: int = 2) -> Cameras:
    views = random_views(torch.Generator().manual_seed(3), count)
    return replace(views, kind=kind, half_width=1.1, width=11, height=9)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("antialias", [1, 2])
@pytest.mark.parametrize("background", [0.0, (0.1, 0.2, 0.3, 0.4)])
def test_lookup_and_its_gradient(mesh, field, rng, kind: str, antialias: int, background):
    views = cameras(kind)
    visibility = Stage(mesh).visibility(views, antialias)
    attached = field.clone().requires_grad_()
    picture = lookup(attached, visibility, background)
    expected = images(mesh, views, field.numpy(), np.array(background), antialias)
    assert picture.shape == (2, 9, 11, 4)
    np.testing.assert_allclose(picture.detach().numpy(), expected, atol=AT_A_SLANT)

    upstream = torch.from_numpy(rng.normal(size=picture.shape).astype(np.float32))
    (picture * upstream).sum().backward()
    reference = field.double().requires_grad_()
    weights = torch.from_numpy(matrix(mesh, views, antialias))
    (weights @ reference * upstream).sum().backward()
    np.testing.assert_allclose(gradient(attached), gradient(reference), atol=AT_A_SLANT)

    direction = torch.from_numpy(rng.normal(size=field.shape).astype(np.float32))
    high, low = (lookup(field + t * direction, visibility, background).double() for t in (0.1, -0.1))
    slope = ((high - low) * upstream).sum() / 0.2
    assert float(slope) == pytest.approx(float((gradient(attached) * direction.numpy()).sum()), rel=1e-2)


def test_lookup_of_a_slice_and_of_a_parameter(mesh, field):
    visibility = Stage(mesh).visibility(cameras())
    state = torch.nn.Parameter(field)
    lookup(state[:, 1:3], visibility).sum().backward()
    np.testing.assert_array_equal(gradient(state)[:, 0], 0)
    ones = torch.ones(*visibility.shape).flatten()
    np.testing.assert_allclose(gradient(state)[:, 1], visibility.matrix.to_dense().T @ ones, atol=1e-5)
    with torch.no_grad():
        part = lookup(state[:, 1:3], visibility)
        np.testing.assert_array_equal(part, lookup(state[:, 1:3].contiguous(), visibility))
        # Products of four and of two columns take different code on some CPUs: equal up to the last bits.
        np.testing.assert_array_max_ulp(lookup(state, visibility)[..., 1:3].numpy(), part.numpy(), maxulp=8)


def test_lookup_refuses_second_derivatives(mesh, field):
    visibility = Stage(mesh).visibility(cameras())
    attached = field.requires_grad_()
    (first,) = torch.autograd.grad((lookup(attached, visibility) ** 2).sum(), attached, create_graph=True)
    with pytest.raises(RuntimeError, match="once_differentiable"):
        first.sum().backward()


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda f: f[:-1], "does not fit a mesh"),
        (lambda f: f[None], "does not fit a mesh"),
        (lambda f: f.double(), "float64"),
        (lambda f: f.to(torch.uint8), "uint8"),
        (lambda f: f.to("meta"), "meta"),
    ],
)
def test_lookup_refuses(mesh, field, change, problem: str):
    visibility = Stage(mesh).visibility(cameras())
    with pytest.raises(ConfigError, match=problem):
        lookup(change(field), visibility)
    with pytest.raises(ConfigError, match="background"):
        lookup(field, visibility, background=(0.0, 1.0))


@pytest.fixture
def stage(mesh) -> Stage:
    return Stage(mesh, channels=4, background=(0.1, 0.2, 0.3, 0.4))


def sensor(mi, views: Cameras):
    return mi.load_dict(views.sensors()[0])


def test_render_equals_lookup_with_its_gradient(mi, stage, field, rng):
    views = cameras(count=1)
    upstream = torch.from_numpy(rng.normal(size=(9, 11, 4)).astype(np.float32))
    first, second = (field.clone().requires_grad_() for _ in range(2))
    picture = render(stage.scene, first, sensor(mi, views))
    expected = lookup(second, stage.visibility(views), stage.background)[0]
    np.testing.assert_allclose(picture.detach(), expected.detach(), atol=1e-5)
    (picture * upstream).sum().backward()
    (expected * upstream).sum().backward()
    np.testing.assert_allclose(gradient(first), gradient(second), atol=1e-5)
    fine = render(stage.scene, field, sensor(mi, views), spp=4)
    np.testing.assert_allclose(
        fine, lookup(field, stage.visibility(views, 2), stage.background)[0], atol=1e-5
    )


def test_render_by_parameter_names(mi, stage, field):
    names = (Stage.FIELD, "mesh.bsdf.reflectance.scale", "integrator.background")
    values = field.clone(), torch.tensor([0.5]), torch.tensor([0.9, 0.8, 0.7, 0.6])
    values = [v.requires_grad_() for v in values]
    render(stage.scene, dict(zip(names, values, strict=True)), sensor(mi, cameras(count=1))).sum().backward()
    visibility = stage.visibility(cameras(count=1))
    empty = float((1 - visibility.coverage).sum())
    np.testing.assert_allclose(gradient(values[2]), empty, rtol=1e-5)
    assert gradient(values[1]).item() == pytest.approx(float(lookup(field, visibility).sum()), rel=1e-4)
    expected = visibility.matrix.to_dense().sum(0)[:, None] * 0.5
    np.testing.assert_allclose(gradient(values[0]), expected.expand(-1, 4), atol=1e-5)


def test_render_keeps_the_gradient_of_earlier_pictures(mi, stage, field):
    """Two pictures, then the gradient of the first: it must not be that of the scene as it is now."""
    view = sensor(mi, cameras(count=1))
    scale = torch.tensor([3.0], requires_grad=True)
    first = render(stage.scene, {Stage.FIELD: field, "mesh.bsdf.reflectance.scale": scale}, view)
    render(stage.scene, {Stage.FIELD: torch.zeros_like(field)}, view)
    first.sum().backward()
    expected = lookup(field, stage.visibility(cameras(count=1))).sum()
    assert gradient(scale).item() == pytest.approx(float(expected), rel=1e-4)


def test_render_with_another_integrator(mi, stage, field):
    integrator = mi.load_dict({"type": "feature", "name": "reflectance", "background": 0.0})
    background = torch.zeros(1, requires_grad=True)
    values = {Stage.FIELD: field, "integrator.background": background}
    picture = render(stage.scene, values, sensor(mi, cameras(count=1)), integrator)
    np.testing.assert_allclose(picture[0, 0].detach(), 0)
    picture.sum().backward()
    assert gradient(background).item() > 0


def test_render_takes_a_parameter(mi, stage, field):
    parameter = torch.nn.Parameter(field)
    render(stage.scene, parameter, sensor(mi, cameras(count=1))).sum().backward()
    assert np.abs(gradient(parameter)).sum() > 0


def test_render_refuses_second_derivatives(mi, stage, field):
    attached = field.requires_grad_()
    loss = (render(stage.scene, attached, sensor(mi, cameras(count=1))) ** 2).sum()
    (first,) = torch.autograd.grad(loss, attached, create_graph=True)
    with pytest.raises(RuntimeError, match="once_differentiable|does not require grad"):
        first.sum().backward()


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda f: f.double(), "float64.*float()"),
        (lambda f: f.to(torch.uint8), "uint8"),
        (lambda f: f.to("meta"), "meta"),
        (lambda f: f[:-1], "has shape"),
        (lambda f: {"mesh.bsdf.reflectance.dat": f}, "did you mean mesh.bsdf.reflectance.data"),
        (lambda f: {"mesh.faces": f}, "not a differentiable"),
        (lambda f: {Stage.FIELD: f.numpy()}, "ndarray"),
        (lambda f: {"integrator.background": f}, "has shape"),
    ],
)
def test_render_refuses(mi, stage, field, change, problem: str):
    with pytest.raises(ConfigError, match=problem):
        render(stage.scene, change(field), sensor(mi, cameras(count=1)))


def test_render_needs_one_field_and_a_feature_integrator(mi, field):
    view = {"sensor": cameras(count=1).sensors()[0]}
    empty = mi.load_dict({"type": "scene", "integrator": {"type": "path"}} | view)
    with pytest.raises(ConfigError, match="by parameter name"):
        render(empty, field)
    checks = {"type": "feature", "field": {"type": "checkerboard"}}
    with pytest.raises(ConfigError, match="0 fields"):
        render(mi.load_dict({"type": "scene", "integrator": checks} | view), field)


def test_render_a_hundred_times_does_not_grow(mi, stage, field):
    view = sensor(mi, cameras(count=1))

    def use() -> int:
        attached = field.clone().requires_grad_()
        render(stage.scene, attached, view).sum().backward()
        return live_variables()

    counts = [use() for _ in range(100)]
    assert counts[-1] <= max(counts[2:10])


def aside(mi) -> dict:
    """A camera that looks at the origin from the side of the ball."""
    return {
        "type": "perspective",
        "fov": 40,
        "to_world": mi.ScalarTransform4f().look_at([0.5, -1, 3], [0, 0, 0], [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": 32, "height": 32, "rfilter": {"type": "box"}},
    }


@pytest.fixture
def lit(mi):
    """A textured square under a lamp and a sky, beside a ball whose colour it reflects."""
    look = mi.ScalarTransform4f().look_at
    texture = {
        "type": "texel_field",
        "data": upload(mi.TensorXf, np.full((8, 8, 3), 0.5, np.float32)),
        "charts": upload(mi.TensorXf, np.zeros((8, 8), np.float32)),
    }
    ball = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.2, 0.1]}}
    lamp = look([0, 0, 4], [0, 0, 0], [0, 1, 0])
    scene = {
        "type": "scene",
        "integrator": {"type": "prb", "max_depth": 3},
        "square": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": texture}},
        "ball": {"type": "sphere", "radius": 0.4, "center": [0.5, 0.5, 0.5], "bsdf": ball},
        "lamp": {"type": "rectangle", "to_world": lamp, "emitter": {"type": "area", "radiance": 3.0}},
        "sky": {"type": "constant", "radiance": 0.3},
        "sensor": aside(mi),
    }
    return mi.load_dict(scene)


BALL = "ball.bsdf.reflectance.value"


def picture_loss(name: str, before: torch.Tensor):
    """A loss of pictures (32, 32, 3) of linear radiance; the motion is that since `before`, moved a bit."""
    network = Vgg16(precision="float32")
    target = torch.rand(32, 32, 3, generator=torch.Generator().manual_seed(1))

    def features(picture: torch.Tensor) -> torch.Tensor:
        return network.features(picture[None], ["relu2_1"])["relu2_1"].flatten(1, 2)

    def motion(picture: torch.Tensor) -> torch.Tensor:
        flow = lucas_kanade(before.roll(1, 1).mean(2)[None, None], picture.mean(2)[None, None])
        wanted = torch.tensor([0.4, 0.1]).view(1, 2, 1, 1).expand_as(flow)
        return motion_loss(flow, wanted, steps=1, period=1, gamma=0.2).total

    return {
        "gram": lambda picture: gram_loss({"a": features(picture)}, {"a": gram_matrix(features(target)[0])}),
        "transport": lambda picture: relaxed_transport(features(picture), features(target)).sum(),
        "motion": motion,
        "mean": lambda picture: picture.square().mean(),
    }[name]


@pytest.mark.parametrize("name", ["gram", "transport", "motion", "mean"])
def test_gradients_through_traced_light(mi, lit, rng, name: str):
    """Differences of pictures of the same paths, and gradients of other ones."""
    names = [key for key in mi.traverse(lit).keys() if key.endswith(".data")]  # noqa: SIM118
    texture = torch.from_numpy(rng.uniform(0.3, 0.7, (8, 8, 3)).astype(np.float32)).requires_grad_()
    colour = torch.tensor([0.7, 0.2, 0.1], requires_grad=True)
    with torch.no_grad():
        loss = picture_loss(name, render(lit, {names[0]: texture, BALL: colour}, spp=256, seed=3))

    def value(shift: float, along: Sequence[torch.Tensor]) -> torch.Tensor:
        moved = {names[0]: texture + shift * along[0], BALL: colour + shift * along[1]}
        return loss(render(lit, moved, spp=256, seed=3))

    value(0.0, [torch.zeros(8, 8, 3), torch.zeros(3)]).backward()
    slopes = gradient(texture), gradient(colour)
    along = [torch.from_numpy(np.sign(slope)) for slope in slopes]
    with torch.no_grad():
        difference = float(value(4e-3, along) - value(-4e-3, along)) / 8e-3
    expected = sum(float(np.abs(slope).sum()) for slope in slopes)
    assert expected > 0 and difference == pytest.approx(expected, rel=0.1)


def test_gradients_of_an_earlier_picture_of_traced_light(mi, lit):
    """They are those of its own values, and the scene keeps the later ones."""
    first = torch.tensor([0.2, 0.2, 0.2], requires_grad=True)
    early = render(lit, {BALL: first}, spp=16)
    kept = torch.tensor([0.9, 0.5, 0.1])
    late = render(lit, {BALL: kept}, spp=16)
    assert late[..., 0].sum() > early[..., 0].sum()
    early.sum().backward()
    fresh = torch.tensor([0.2, 0.2, 0.2], requires_grad=True)
    render(lit, {BALL: fresh}, spp=16).sum().backward()
    np.testing.assert_allclose(gradient(first), gradient(fresh), rtol=1e-4)
    render(lit, {BALL: kept}, spp=16)
    early = render(lit, {BALL: first}, spp=16)
    render(lit, {BALL: kept}, spp=16)
    early.sum().backward()
    np.testing.assert_allclose(np.ravel(mi.traverse(lit)[BALL]), kept, rtol=1e-6)


@pytest.mark.parametrize("other", ["lamp", "camera", "sensor", "texels", "geometry"])
def test_gradients_of_an_earlier_picture_when_something_else_has_changed(other, mi, lit):
    """They are those of the scene as it was seen, which keeps what it has got since."""
    params, sensor = mi.traverse(lit), mi.load_dict(aside(mi))
    moved = mi.Transform4f().look_at([2, 1, 3], [0, 0, 0], [0, 1, 0])
    texels = next(key for key in params.keys() if key.endswith(".data"))  # noqa: SIM118
    changes = {
        "lamp": (params, "lamp.emitter.radiance.value", 0.5),
        "camera": (params, "sensor.to_world", moved),
        "sensor": (mi.traverse(sensor), "to_world", moved),
        "texels": (params, texels, upload(mi.TensorXf, np.full((8, 8, 3), 0.05, np.float32))),
        "geometry": (params, "ball.to_world", mi.Transform4f().translate([-0.8, -0.2, 0.4]).scale(0.3)),
    }

    def picture(colour: torch.Tensor) -> torch.Tensor:
        return render(lit, {BALL: colour}, sensor if other == "sensor" else 0, spp=16)

    expected, early = (torch.tensor([0.2, 0.2, 0.2], requires_grad=True) for _ in range(2))
    picture(expected).sum().backward()
    first = picture(early)
    table, key, value = changes[other]
    table[key] = value
    table.update()
    second = picture(torch.tensor([0.2, 0.2, 0.2]))
    assert float((second - first).detach().abs().max()) > 0.01
    first.sum().backward()
    np.testing.assert_allclose(gradient(early), gradient(expected), rtol=1e-4)
    np.testing.assert_allclose(picture(torch.tensor([0.2, 0.2, 0.2])), second, atol=1e-6)


def test_torch_s_tensors_become_arrays_of_llvm(field, monkeypatch):
    """In another variant Dr.Jit would mix the two, or end the process where there is no LLVM."""
    monkeypatch.setattr(dr, "backend_v", lambda _: dr.JitBackend.CUDA)
    with pytest.raises(ConfigError, match="torch's gradients through Dr.Jit: .* use an llvm one"):
        call(lambda array: array, field)


def test_seeds_are_other_noise(lit):
    colour = torch.tensor([0.7, 0.2, 0.1])
    one, same, other = (render(lit, {BALL: colour}, spp=4, seed=seed) for seed in (1, 1, 2))
    assert torch.equal(one, same) and not torch.equal(one, other)
    assert float(one.mean()) == pytest.approx(float(other.mean()), rel=0.1)
