"""motion: against projected points that are moved a little, and against spheres in closed form."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from mitex import bridge
from mitex.errors import ConfigError
from mitex.mesh import Mesh, icosphere
from mitex.runtime.upload import upload
from mitex.scenes import Cameras, random_views
from mitex.scenes.shapes import mesh_shape
from tests.scenes.helpers import front_camera
from tests.scenes.reference import trace

BALL = icosphere(3)


@pytest.fixture
def vectors(rng) -> np.ndarray:
    return rng.normal(size=(len(BALL.vertices), 3)).astype(np.float32)


def cameras(kind: Any = "perspective", count: int = 1) -> Cameras:
    views = random_views(torch.Generator().manual_seed(5), count)
    return replace(views, kind=kind, half_width=1.2, width=8, height=6)


def project(views: Cameras, points: np.ndarray) -> np.ndarray:
    """Places (N, 2) of points (N, 3) on the film of the first camera, x to the right and y down [pixels]."""
    right, up, forward = (axes[0].astype(np.float64) for axes in views.axes())
    offset = points - views.origin[0]
    x, y, z = offset @ right, offset @ up, offset @ forward
    half = 0.5 * views.height
    scale = half / (
        z * np.tan(np.radians(views.fov) / 2) if views.kind == "perspective" else views.half_width
    )
    return np.stack([0.5 * views.width + x * scale, half - y * scale], axis=1)


def reference(mesh: Mesh, views: Cameras, vectors: np.ndarray, antialias: int) -> np.ndarray:
    """(H, W, 3) motion and coverage by central differences of projected points; vectors (V, 3) or (F, 3)."""
    fine = replace(views, width=views.width * antialias, height=views.height * antialias)
    origins, directions = (rays.reshape(-1, 3) for rays in fine.rays())
    face, weights = trace(mesh, origins, directions)
    corners = mesh.faces[face]
    points = np.einsum("nk,nkc->nc", weights, mesh.vertices[corners])
    of_faces = len(vectors) == len(mesh.faces)
    velocity = vectors[face] if of_faces else np.einsum("nk,nkc->nc", weights, vectors[corners])
    covered = (face >= 0)[:, None]
    step = 1e-5
    motion = (project(views, points + step * velocity) - project(views, points - step * velocity)) / (
        2 * step
    )
    samples = np.concatenate([np.where(covered, motion, 0.0), covered], axis=1)
    total = samples.reshape(views.height, antialias, views.width, antialias, 3).sum(axis=(1, 3))
    mean = total[..., :2] / np.maximum(total[..., 2:], 1)
    return np.concatenate([mean, total[..., 2:] / antialias**2], axis=-1)


def field(mi, values: np.ndarray) -> dict:
    return {"type": "vertex_field", "data": upload(mi.TensorXf, values), "raw": True}


def moving(values: np.ndarray, mesh: Mesh = BALL, name: str = "vertex_motion"):
    shape = mesh_shape(mesh)
    shape.add_attribute(name, 3, values.ravel().tolist())
    return shape


def scene(mi, sensor: dict, integrator: dict, **shapes):
    parts = {"type": "scene", "sensor": sensor, "integrator": {"type": "motion"} | integrator}
    return mi.load_dict(parts | (shapes or {"ball": mesh_shape(BALL)}))


def image(mi, sensor: dict, integrator: dict, **shapes) -> np.ndarray:
    return np.array(mi.render(scene(mi, sensor, integrator, **shapes)))


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("antialias", [1, 2])
def test_motion_is_that_of_projected_points(mi, vectors, kind, antialias):
    views = cameras(kind)
    picture = image(mi, views.sensors()[0], {"field": field(mi, vectors), "antialias": antialias})
    assert picture.shape == (6, 8, 4)
    expected = reference(BALL, views, vectors, antialias)
    np.testing.assert_allclose(picture[..., 3], expected[..., 2], atol=1e-6)
    np.testing.assert_allclose(picture[..., :2], expected[..., :2], atol=1e-3)
    assert 0 < expected[..., 2].mean() < 1
    assert np.abs(expected[..., :2]).max() > 1


@pytest.mark.parametrize("antialias", [1, 2])
def test_vectors_may_belong_to_the_faces(mi, rng, antialias):
    views, vectors = cameras(), rng.normal(size=(len(BALL.faces), 3)).astype(np.float32)
    options = {"attribute": "face_flow", "antialias": antialias}
    picture = image(mi, views.sensors()[0], options, ball=moving(vectors, name="face_flow"))
    expected = reference(BALL, views, vectors, antialias)
    np.testing.assert_allclose(picture[..., 3], expected[..., 2], atol=1e-6)
    np.testing.assert_allclose(picture[..., :2], expected[..., :2], atol=1e-3)
    assert np.abs(expected[..., :2]).max() > 1


def test_a_turning_sphere_in_orthographic_view(mi):
    ball = icosphere(24)
    turn = np.cross([0.0, 1.0, 0.0], ball.vertices).astype(np.float32)
    view = front_camera("orthographic", 3.0, half_width=1.25, width=10, height=10)
    picture = image(mi, view.sensors()[0], {}, ball=moving(turn, ball))
    y, x = np.meshgrid(0.25 * (4.5 - np.arange(10)), 0.25 * (np.arange(10) - 4.5), indexing="ij")
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0.0))
    inside = x**2 + y**2 < 0.95
    np.testing.assert_allclose(picture[inside, 0], z[inside] / 0.25, atol=0.03)
    np.testing.assert_allclose(picture[inside, 1], 0.0, atol=1e-4)
    np.testing.assert_allclose(picture[inside, 2], 3 - z[inside], atol=0.01)
    np.testing.assert_array_equal(picture[..., 3], x**2 + y**2 < 1)


def test_it_is_as_exact_on_a_large_film(mi, vectors):
    """A strip of 2,048 pixels: the differences of rays must not shrink with them."""
    views = front_camera("orthographic", 2.5, half_width=1.1 / 1024, width=2048, height=2)
    picture = image(mi, views.sensors()[0], {}, ball=moving(vectors))
    expected = reference(BALL, views, vectors, 1)
    inside = (picture[..., 3] == 1) & (expected[..., 2] == 1)
    error = np.abs(picture[..., :2] - expected[..., :2])[inside] / np.abs(expected[inside][:, :2]).max()
    assert inside.mean() > 0.5 and np.percentile(error[:, 0], 95) < 5e-6


def test_a_turning_sphere_in_perspective(mi):
    ball, distance, slope = icosphere(24), 2.5, np.tan(np.radians(30))
    axis = np.array([0.5, 1.0, -0.25])
    turn = np.cross(axis, ball.vertices).astype(np.float32)
    view = front_camera("perspective", distance, fov=60.0, width=10, height=10)
    picture = image(mi, view.sensors()[0], {}, ball=moving(turn, ball))
    y, x = np.meshgrid(slope * (4.5 - np.arange(10)) / 5, slope * (np.arange(10) - 4.5) / 5, indexing="ij")
    ray = np.stack([x, y, -np.ones_like(x)], axis=-1)
    square = (ray**2).sum(axis=-1)
    root = distance**2 - square * (distance**2 - 1)
    t = (distance - np.sqrt(np.maximum(root, 0.0))) / square  # how far down the view axis
    point = [0, 0, distance] + t[..., None] * ray
    u, v, w = np.moveaxis(np.cross(axis, point), -1, 0)
    # Where x / t is on the film, and its derivative: (u + x w) / t, as t falls by w.
    inside = root > 0.3
    pixels = 5 / slope / t
    np.testing.assert_allclose(picture[inside, 0], ((u + x * w) * pixels)[inside], atol=0.05)
    np.testing.assert_allclose(picture[inside, 1], (-(v + y * w) * pixels)[inside], atol=0.05)
    np.testing.assert_allclose(picture[inside, 2], (t * np.sqrt(square))[inside], atol=0.01)
    assert inside.sum() > 20


def test_the_film_of_the_sensor_counts(mi, vectors):
    film = {"type": "hdrfilm", "width": 12, "height": 8}
    to_world = mi.ScalarTransform4f().look_at([1, 0.4, 3], [0.1, 0, 0], [0.3, 1, 0])
    sensor = {"type": "perspective", "fov": 45, "fov_axis": "x", "to_world": to_world, "film": film}
    integrator = {"field": field(mi, vectors)}
    whole = image(mi, sensor, integrator)
    moved = image(mi, sensor | {"principal_point_offset_x": 2 / 12}, integrator)
    np.testing.assert_allclose(moved[:, :-2], whole[:, 2:], atol=1e-3)
    crop = {"crop_width": 5, "crop_height": 4, "crop_offset_x": 3, "crop_offset_y": 2}
    np.testing.assert_allclose(
        image(mi, sensor | {"film": film | crop}, integrator), whole[2:6, 3:8], atol=1e-3
    )
    thin = sensor | {"type": "thinlens", "aperture_radius": 0.2, "focus_distance": 2.0}
    np.testing.assert_allclose(image(mi, thin, integrator), whole, atol=1e-3)
    fine = image(mi, sensor | {"film": film | {"width": 36, "height": 24}}, integrator)
    np.testing.assert_allclose(fine[1::3, 1::3], whole * [3, 3, 1, 1], atol=1e-3)


def test_batch_sensor_renders_all_views_in_one_pass(mi, vectors):
    views = cameras(count=2)
    integrator = {"field": field(mi, vectors)}
    film = {"type": "hdrfilm", "width": 16, "height": 6, "rfilter": {"type": "box"}}
    batch = {"type": "batch", "film": film} | {f"view{k}": s for k, s in enumerate(views.sensors())}
    both = [image(mi, sensor, integrator) for sensor in views.sensors()]
    np.testing.assert_allclose(image(mi, batch, integrator), np.concatenate(both, axis=1), atol=1e-3)


def test_silhouettes_are_as_fast_as_the_rest(mi):
    steady = np.tile(np.array([1.0, 2.0, 0.5], np.float32), (len(BALL.vertices), 1))
    view = front_camera("orthographic", 3.0, half_width=2.0, width=8, height=8)
    picture = image(mi, view.sensors()[0], {"antialias": 4}, ball=moving(steady))
    covered = picture[..., 3] > 0
    assert ((picture[..., 3] > 0) & (picture[..., 3] < 1)).sum() > 8
    np.testing.assert_allclose(picture[covered][:, :2], np.tile([2.0, -4.0], (covered.sum(), 1)), atol=1e-4)
    assert picture[covered][:, 2].min() > 1.9
    assert not picture[~covered].any()


def test_shapes_without_the_attribute_hide_what_moves(mi, vectors):
    half = {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([1, 0, 1.5])}
    view = front_camera("orthographic", 3.0, half_width=1.5, width=8, height=8)
    alone = image(mi, view.sensors()[0], {}, ball=moving(vectors))
    picture = image(mi, view.sensors()[0], {}, ball=moving(vectors), wall=mi.load_dict(half))
    np.testing.assert_allclose(picture[:, :4], alone[:, :4], atol=1e-6)
    assert not picture[1:7, 4:].any()


@pytest.mark.parametrize("source", ["field", "attribute"])
def test_derivatives(mi, vectors, rng, source):
    """The image is linear: both modes against images of other vectors."""
    from mitex.runtime.jit import dr

    sensor, options = cameras().sensors()[0], {"antialias": 2}
    if source == "field":
        world, key = scene(mi, sensor, options | {"field": field(mi, vectors)}), "integrator.field.data"
    else:
        world = scene(
            mi, sensor, options | {"attribute": "vertex_flow"}, ball=moving(vectors, name="vertex_flow")
        )
        key = "ball.vertex_flow"
    direction = rng.normal(size=vectors.shape).astype(np.float32)
    change = image(mi, sensor, options, ball=moving(direction)) * [1, 1, 0, 0]
    upstream = rng.normal(size=change.shape).astype(np.float32)
    params = mi.traverse(world)
    rows = type(params[key])
    value, slope = (mi.TensorXf(v) if source == "field" else rows(v.ravel()) for v in (vectors, direction))

    def attached() -> tuple:
        t = mi.Float(0.0)
        dr.enable_grad(t)
        params[key] = value + t * slope
        params.update()
        return t, mi.render(world, params)

    t, picture = attached()
    dr.forward(t)
    np.testing.assert_allclose(np.array(dr.grad(picture)), change, atol=1e-4)
    t, picture = attached()
    dr.backward(dr.sum((picture * mi.TensorXf(upstream)).array))
    assert dr.grad(t)[0] == pytest.approx(float((upstream * change).sum()), rel=1e-3)


def test_bridge_to_torch(mi, vectors):
    world = scene(mi, cameras().sensors()[0], {"field": field(mi, 0 * vectors)})
    values = torch.from_numpy(vectors).requires_grad_()
    picture = bridge.render(world, values)
    expected = image(mi, cameras().sensors()[0], {}, ball=moving(vectors))
    np.testing.assert_allclose(picture.detach().numpy(), expected, atol=1e-5)
    (gradient,) = torch.autograd.grad(picture[..., :2].square().sum() / 2, values)
    assert float((gradient * values.detach()).sum()) == pytest.approx(
        float((expected[..., :2] ** 2).sum()), rel=1e-3
    )


def test_nothing_in_view(mi, vectors):
    away = front_camera("perspective", -9.0, fov=20.0, width=3, height=2).sensors()[0]
    away["to_world"] = mi.ScalarTransform4f().look_at([0, 0, 9], [0, 0, 99], [0, 1, 0])
    assert not image(mi, away, {}, ball=moving(vectors)).any()
    assert not image(mi, away, {"field": field(mi, vectors)}, light={"type": "constant"}).any()


@pytest.mark.parametrize(
    ("integrator", "problem"),
    [
        ({"field": {"type": "checkerboard"}, "attribute": "vertex_motion"}, "both 'field' and 'attribute'"),
        ({"field": {"type": "sphere"}}, "give a texture"),
        ({"attribute": "motion"}, "begins with vertex_ or face_"),
        ({"antialias": 0}, "antialias"),
    ],
)
def test_bad_properties_are_refused(mi, integrator, problem):
    with pytest.raises(RuntimeError, match=problem):
        mi.load_dict({"type": "motion"} | integrator)


def test_bad_renders_are_refused(mi, vectors):
    def problem(integrator: dict, **shapes) -> str:
        world = scene(mi, cameras().sensors()[0], integrator, **shapes)
        with pytest.raises(ConfigError) as caught:
            world.integrator().render(world)
        return str(caught.value)

    assert "no shape of the scene has an attribute 'vertex_motion'; add one" in problem({})
    short = mesh_shape(BALL)
    short.add_attribute("vertex_motion", 1, vectors[:, 0].tolist())
    assert "'vertex_motion' of mesh 'ball' has 1 numbers each; give it 3" in problem({}, ball=short)
    short.add_attribute("face_flow", 2, [0.0] * 2 * len(BALL.faces))
    assert "'face_flow' of mesh 'ball' has 2 numbers" in problem({"attribute": "face_flow"}, ball=short)
    assert "has 2 channels; give one of 3" in problem({"field": field(mi, vectors[:, :2].copy())})
    assert "has 92 vertices" in problem({"field": field(mi, vectors[:50].copy())})
    world = scene(mi, cameras().sensors()[0], {"field": field(mi, vectors)})
    with pytest.raises(ConfigError, match="square number"):
        world.integrator().render(world, spp=3)


def test_other_variants(mi, vectors):
    before, expected = mi.variant(), image(mi, cameras().sensors()[0], {}, ball=moving(vectors))
    try:
        mi.set_variant("llvm_ad_spectral")
        picture = image(mi, cameras().sensors()[0], {}, ball=moving(vectors))
        np.testing.assert_allclose(picture, expected, atol=1e-4)
        mi.set_variant("scalar_rgb")
        with pytest.raises(RuntimeError, match="llvm or cuda"):
            mi.load_dict({"type": "motion"})
    finally:
        mi.set_variant(before)


def test_to_string(mi, vectors):
    assert str(mi.load_dict({"type": "motion"})) == (
        "MotionIntegrator[\n  attribute = vertex_motion,\n  antialias = 1\n]"
    )
    text = str(mi.load_dict({"type": "motion", "field": field(mi, vectors), "antialias": 2}))
    assert text.startswith("MotionIntegrator[\n  field = VertexField[\n    vertices")
