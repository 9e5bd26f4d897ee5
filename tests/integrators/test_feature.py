"""feature: pictures against a slow per-pixel lookup, adjoint against autograd and finite differences."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.geometry.tangents import split_at_seams
from mitex.mesh import Mesh, icosphere
from mitex.runtime.upload import upload
from mitex.scenes import Cameras, random_views
from mitex.scenes.shapes import mesh_shape
from tests.scenes.helpers import front_camera, gradient
from tests.scenes.reference import images, matrix


@pytest.fixture
def mesh(rng) -> Mesh:
    ball = icosphere(3)
    return ball.with_vertices(ball.vertices * rng.uniform(0.85, 1.0, (len(ball.vertices), 1)))


@pytest.fixture
def data(mesh, rng) -> np.ndarray:
    return rng.uniform(-0.5, 1.5, (len(mesh.vertices), 5)).astype(np.float32)


def cameras(kind: str = "perspective", count: int = 1, width: int = 11, height: int = 9) -> Cameras:
    views = random_views(torch.Generator().manual_seed(3), count)
    return replace(views, kind=kind, half_width=1.1, width=width, height=height)


def field(mi, data: np.ndarray, **options) -> dict:
    return {"type": "vertex_field", "data": upload(mi.TensorXf, data)} | options


def scene(mi, mesh: Mesh, views: Cameras, integrator: dict, bsdf=None):
    parts = {"mesh": mesh_shape(mesh, bsdf), "sensor": views.sensors()[0]}
    return mi.load_dict({"type": "scene", "integrator": {"type": "feature"} | integrator} | parts)


def batch(mi, views: Cameras, **film) -> dict:
    count, height, width = views.shape
    film = {"type": "hdrfilm", "width": count * width, "height": height, "rfilter": {"type": "box"}} | film
    return {"type": "batch", "film": film} | {f"view{k}": s for k, s in enumerate(views.sensors())}


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("antialias", [1, 2])
def test_picture_equals_the_slow_lookup(mi, mesh, data, kind: str, antialias: int):
    views = cameras(kind)
    world = scene(mi, mesh, views, {"field": field(mi, data), "antialias": antialias})
    expected = images(mesh, views, data, 0.0, antialias)[0]
    picture = np.array(mi.render(world))
    assert picture.shape == (9, 11, 5)
    np.testing.assert_allclose(picture, expected, atol=1e-5)
    assert (picture == 0).all(axis=-1).any()  # the background is in view
    if antialias == 1:
        np.testing.assert_allclose(
            np.array(mi.render(world, spp=4)), images(mesh, views, data, 0.0, 2)[0], atol=1e-5
        )


def test_uvs_do_not_matter(mi, mesh, data, rng):
    views = cameras()
    split = split_at_seams(mesh, rng.uniform(0, 1, (len(mesh.faces), 3, 2)))
    bsdf = {"type": "diffuse", "reflectance": field(mi, data[split.source])}
    shape = mesh_shape(mesh, bsdf, split=split)
    integrator = {"type": "feature", "name": "reflectance"}
    world = mi.load_dict(
        {"type": "scene", "mesh": shape, "sensor": views.sensors()[0], "integrator": integrator}
    )
    np.testing.assert_allclose(np.array(mi.render(world)), images(mesh, views, data)[0], atol=1e-5)


def test_batch_sensor_renders_all_views_in_one_pass(mi, mesh, data):
    views = cameras(
        count=4, width=8, height=9
    )  # powers of two: the batch sensor's own coordinates stay exact
    world = mi.load_dict(
        {
            "type": "scene",
            "mesh": mesh_shape(mesh),
            "sensor": batch(mi, views),
            "integrator": {"type": "feature", "field": field(mi, data)},
        }
    )
    picture = np.array(mi.render(world)).reshape(9, 4, 8, 5).swapaxes(0, 1)
    np.testing.assert_allclose(picture, images(mesh, views, data), atol=1e-5)


def test_crop_is_a_part_of_the_picture(mi, mesh, data):
    views = cameras(width=12, height=10)
    whole = np.array(mi.render(scene(mi, mesh, views, {"field": field(mi, data)})))
    sensor = views.sensors()[0]
    sensor["film"] |= {"crop_width": 5, "crop_height": 4, "crop_offset_x": 3, "crop_offset_y": 2}
    world = scene(mi, mesh, views, {"field": field(mi, data)})
    np.testing.assert_allclose(
        np.array(mi.render(world, sensor=mi.load_dict(sensor))), whole[2:6, 3:8], atol=1e-4
    )


@pytest.mark.parametrize("value", [0.3, [0.1, 0.2, 0.3, 0.4, 0.5]], ids=["one", "each"])
def test_background(mi, mesh, data, value):
    background = value if isinstance(value, float) else upload(mi.TensorXf, np.array([value], np.float32))
    views = cameras()
    world = scene(mi, mesh, views, {"field": field(mi, data), "background": background})
    expected = images(mesh, views, data, np.array(value))[0]
    np.testing.assert_allclose(np.array(mi.render(world)), expected, atol=1e-5)


def test_background_of_three_numbers(mi, mesh, data):
    world = scene(mi, mesh, cameras(), {"field": field(mi, data[:, :3]), "background": [0.1, 0.2, 0.3]})
    np.testing.assert_allclose(np.array(mi.render(world))[0, 0], (0.1, 0.2, 0.3), atol=1e-6)


@pytest.mark.parametrize("antialias", [1, 2])
def test_adjoint_equals_autograd_of_the_lookup(mi, mesh, data, rng, antialias: int):
    from mitex.runtime.jit import dr

    views = cameras()
    world = scene(
        mi, mesh, views, {"field": field(mi, data, scale=2.0), "background": 0.5, "antialias": antialias}
    )
    weights = torch.from_numpy(matrix(mesh, views, antialias)[0])
    upstream = rng.normal(size=(9, 11, 5)).astype(np.float32)

    values = torch.from_numpy(data).double().requires_grad_()
    background = torch.tensor(0.5, dtype=torch.float64, requires_grad=True)
    expected = 2 * weights @ values + (1 - weights.sum(-1, keepdim=True)) * background
    (expected * torch.from_numpy(upstream)).sum().backward()

    params = mi.traverse(world)
    keys = ["integrator.field.data", "integrator.background", "integrator.field.scale"]
    for key in keys:
        dr.enable_grad(params[key])
    params.update()
    dr.backward(dr.sum((mi.render(world, params) * mi.TensorXf(upstream)).array))
    of_data, of_background, of_scale = (dr.grad(params[key]).numpy() for key in keys)
    np.testing.assert_allclose(of_data, gradient(values), atol=1e-5)
    assert of_background[0] == pytest.approx(gradient(background).item(), abs=1e-4)
    assert of_scale[0] == pytest.approx(
        float((weights @ values.detach() * torch.from_numpy(upstream)).sum()), abs=1e-3
    )

    # Finite difference along one direction (the picture is linear).
    direction = rng.normal(size=data.shape).astype(np.float32)

    def loss(value: np.ndarray) -> float:
        params[keys[0]] = mi.TensorXf(value)
        params.update()
        return float((np.array(mi.render(world), np.float64) * upstream).sum())

    slope = (loss(data + 0.1 * direction) - loss(data - 0.1 * direction)) / 0.2
    assert slope == pytest.approx(float((of_data * direction).sum()), rel=1e-2)


def test_forward_mode(mi, mesh, data, rng):
    from mitex.runtime.jit import dr

    views = cameras()
    world = scene(mi, mesh, views, {"field": field(mi, data)})
    direction = rng.normal(size=data.shape).astype(np.float32)
    params = mi.traverse(world)
    t = mi.Float(0.0)
    dr.enable_grad(t)
    params["integrator.field.data"] = mi.TensorXf(data) + t * mi.TensorXf(direction)
    params.update()
    picture = mi.render(world, params)
    dr.forward(t)
    np.testing.assert_allclose(np.array(dr.grad(picture)), images(mesh, views, direction)[0], atol=1e-5)


def test_geometry_is_detached(mi, mesh, data):
    from mitex.runtime.jit import dr

    bsdf = mi.load_dict({"type": "diffuse", "reflectance": field(mi, data)})
    world = scene(mi, mesh, cameras(), {"name": "reflectance"}, bsdf)
    params = mi.traverse(world)
    keys = ["mesh.vertex_positions", "mesh.bsdf.reflectance.data"]
    for key in keys:
        dr.enable_grad(params[key])
    params.update()
    picture = world.integrator().render(world)  # attached without mi.render
    dr.backward(dr.sum(picture.array))
    of_positions, of_data = (np.abs(dr.grad(params[key]).numpy()).sum() for key in keys)
    assert of_positions == 0
    assert of_data > 1


def test_textures_of_several_shapes_by_name(mi, rng):
    quads, values = {}, rng.uniform(0.1, 0.9, (2, 6)).astype(np.float32)
    for k, x in enumerate((-1.0, 1.0)):
        square = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)]) + (x, 0, 0)
        mesh = Mesh(square, np.array([(0, 1, 2), (0, 2, 3)]))
        texture = field(mi, np.repeat(values[k : k + 1], 4, axis=0))
        inner = {"type": "diffuse", "reflectance": texture}
        bsdf = mi.load_dict({"type": "twosided", "nested": inner} if k else inner)
        quads[f"quad{k}"] = mesh_shape(mesh, bsdf)
    quads["wall"] = mi.load_dict(  # no texture called so: it hides what is behind and shows the background
        {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([0, 0, -1]),
            "bsdf": {"type": "dielectric"},
        }
    )
    view = front_camera("orthographic", 3.0, half_width=2.0, width=8, height=8)
    integrator = {"type": "feature", "name": "reflectance", "background": 0.25}
    world = mi.load_dict({"type": "scene", "integrator": integrator, "sensor": view.sensors()[0]} | quads)
    picture = np.array(mi.render(world))
    np.testing.assert_allclose(picture[4, 2], values[0], atol=1e-6)
    np.testing.assert_allclose(picture[3, 5], values[1], atol=1e-6)
    np.testing.assert_allclose(picture[2, 3], 0.25)  # the wall
    np.testing.assert_allclose(picture[0, 0], 0.25)


def test_any_texture_can_be_imaged(mi):
    checks = {"type": "checkerboard", "color0": {"type": "rgb", "value": [0.1, 0.2, 0.3]}, "color1": 0.9}
    view = front_camera("orthographic", 3.0, half_width=1.0, width=2, height=2)
    world = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "feature", "field": checks},
            "sensor": view.sensors()[0],
            "quad": {"type": "rectangle"},
        }
    )
    picture = np.array(mi.render(world))
    assert picture.shape == (2, 2, 3)
    np.testing.assert_allclose(picture[0, 0], picture[1, 1], atol=1e-6)
    assert sorted(picture[0, :, 0]) == pytest.approx([0.1, 0.9])


def test_to_string_and_unknown_property(mi, data):
    text = str(mi.load_dict({"type": "feature", "field": field(mi, data), "antialias": 2}))
    assert text.startswith("FeatureIntegrator[\n  field = VertexField[\n    vertices")
    assert "antialias = 2" in text
    with pytest.raises(RuntimeError, match="backgroud"):
        mi.load_dict({"type": "feature", "field": field(mi, data), "backgroud": 1.0})


@pytest.mark.parametrize(
    ("integrator", "problem"),
    [
        ({}, "either"),
        ({"field": {"type": "checkerboard"}, "name": "reflectance"}, "either"),
        ({"field": {"type": "sphere"}}, "give a texture"),
        ({"name": "x", "antialias": 0}, "antialias"),
    ],
)
def test_bad_properties_are_refused(mi, integrator: dict, problem: str):
    with pytest.raises(RuntimeError, match=problem):
        mi.load_dict({"type": "feature"} | integrator)


@pytest.mark.parametrize(
    ("integrator", "options", "problem"),
    [
        ({"name": "roughness"}, {}, "no shape of the scene"),
        ({"name": "reflectance", "background": "two"}, {}, "2 values for 5 channels"),
        ({"name": "reflectance"}, {"spp": 5}, "square number"),
    ],
)
def test_bad_renders_are_refused(mi, mesh, data, integrator: dict, options: dict, problem: str):
    if "background" in integrator:
        integrator = integrator | {"background": upload(mi.TensorXf, np.zeros((1, 2), np.float32))}
    bsdf = mi.load_dict({"type": "diffuse", "reflectance": field(mi, data)})
    world = scene(mi, mesh, cameras(), integrator, bsdf)
    with pytest.raises(ConfigError, match=problem):
        world.integrator().render(world, **options)


def test_after_a_change_of_variant(mi, data):
    before = mi.variant()
    try:
        mi.set_variant("llvm_ad_mono")
        assert "FeatureIntegrator" in str(mi.load_dict({"type": "feature", "field": field(mi, data)}))
        mi.set_variant("scalar_rgb")
        with pytest.raises(RuntimeError, match="llvm or cuda"):
            mi.load_dict({"type": "feature", "name": "x"})
    finally:
        mi.set_variant(before)
    assert "FeatureIntegrator" in str(mi.load_dict({"type": "feature", "field": field(mi, data)}))
