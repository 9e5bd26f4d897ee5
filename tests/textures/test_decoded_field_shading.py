"""decoded_field in BSDFs, path tracers and `feature`."""

import numpy as np
import pytest
import torch

from mitex.bridge import render
from mitex.colour import srgb_to_linear
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca.decoder.decoder import OFFSET
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.methods.nca.field import fields
from mitex.methods.nca.views import render_views
from mitex.runtime.upload import upload
from mitex.scenes import random_views
from mitex.scenes.shapes import mesh_shape
from mitex.scenes.stage import Stage
from tests.scenes.helpers import gradient
from tests.textures.decoded import EVERY, constant, layers, properties, random_look, random_state
from tests.textures.helpers import FACES, QUAD, quad, radiance, sphere_picture


def test_reflectance_in_a_path_tracer(mi, points):
    """Seen at points of the quad, against torch."""
    mesh, look = Mesh(QUAD, FACES), random_look("smooth", EVERY)
    layers(look)[-1].bias.data[:3] = 0.0
    x, y = points
    shape = quad(mi, {"type": "diffuse", "reflectance": properties(look, mesh)})
    below = x > y  # the triangle 0, 1, 2: corners (-1, -1), (1, -1), (1, 1)
    a, b = np.where(below, (1 - x) / 2, (1 - y) / 2), np.where(below, (x - y) / 2, (1 + x) / 2)
    barycentric = torch.from_numpy(np.column_stack([a, b, 1 - a - b]).astype(np.float32))
    surface = Surface(mesh)
    table = surface.table(random_state(mesh))
    with torch.no_grad():
        encoded = look.decoder(
            surface, table, Points(torch.from_numpy((~below).astype(np.int32)), barycentric)
        )
    expected = srgb_to_linear(encoded[:, :3].numpy().clip(0, 1))
    np.testing.assert_allclose(radiance(mi, shape, x, y), expected, atol=1e-4)
    assert expected.std() > 0.02


def test_constant_field_equals_a_constant(mi):
    """Albedo and roughness of a principled BSDF in a path-traced picture.

    Kernels of path tracers have textures several times: deep networks would take half a minute to compile.
    """
    mesh, look = icosphere(4), random_look("linear", depth=1)
    last = layers(look)[-1]
    last.weight.data.zero_()
    last.bias.data[:4] = torch.tensor([0.2, 0.5, 0.8, 0.3]) - OFFSET
    maps = fields(look, random_state(mesh), mesh)
    varying = {
        "type": "principled",
        "base_color": maps["albedo"] | {"raw": True},
        "roughness": maps["height"],
    }
    color = {"type": "rgb", "value": [0.2, 0.5, 0.8]}
    expected = sphere_picture(mi, {"type": "principled", "base_color": color, "roughness": 0.3})
    np.testing.assert_allclose(sphere_picture(mi, varying), expected, rtol=1e-4, atol=1e-5)


def test_normal_map_and_bump_tilt_the_normal(mi, points):
    nested = {"type": "diffuse", "reflectance": 0.6}
    light = np.array([0.3, 0.2, -1.0]) / np.linalg.norm([0.3, 0.2, -1.0])
    normal = np.array([0.3, -0.2, 0.93])
    normal /= np.linalg.norm(normal)
    encoded = constant(mi, (normal / 2).tolist(), offset=0.5)
    bsdf = {"type": "normalmap", "normalmap": encoded, "bsdf": nested, "use_shadowing_function": False}
    shape = quad(mi, bsdf, QUAD[:, :2])  # uv = xy, so that the tangent frame is the axes
    seen = radiance(mi, shape, *points, light=tuple(light))
    np.testing.assert_allclose(seen, -0.6 * normal @ light, atol=1e-5)

    slope = np.array([0.3, -0.5])
    height = constant(mi, [0.0] * 3, np.repeat(QUAD[:, :2] @ slope[:, None], 3, axis=1) / 2, scale=2.0)
    bsdf = {"type": "bumpmap", "height": height, "bsdf": nested, "use_shadowing_function": False}
    normal = np.array([-slope[0], -slope[1], 1]) / np.linalg.norm([*slope, 1])
    seen = radiance(mi, quad(mi, bsdf), *points, light=tuple(light))
    np.testing.assert_allclose(seen, -0.6 * normal @ light, atol=1e-5)


def test_feature_images_all_channels_with_gradients(mi, rng):
    """Pictures and gradients to states and weights, against torch's own views."""
    mesh, look = icosphere(4), random_look("smooth", ("waves",))
    views = random_views(torch.Generator().manual_seed(3), 1, resolution=12)
    state = random_state(mesh).requires_grad_()
    surface, stage = Surface(mesh), Stage(mesh)
    expected = render_views(look.decoder, state, surface, stage, views, antialias=2)[0]
    upstream = torch.from_numpy(rng.normal(size=expected.shape).astype(np.float32))
    (expected * upstream).sum().backward()

    integrator = {"type": "feature", "antialias": 2, "field": properties(look, mesh)}
    scene = {
        "type": "scene",
        "integrator": integrator,
        "mesh": mesh_shape(mesh),
        "sensor": views.sensors()[0],
    }
    scene = mi.load_dict(scene)
    layer = layers(look)[1]
    mine, weight = (v.detach().clone().requires_grad_() for v in (state, layer.weight))
    named = {"integrator.field.data": mine, "integrator.field.weight_1": weight}
    picture = render(scene, named)
    hit = (expected != 0).any(-1)  # the plugin's background is 0 too
    np.testing.assert_allclose(picture.detach()[hit], expected.detach()[hit], atol=2e-5)
    (picture * upstream).sum().backward()
    for one, other in ((mine, state), (weight, layer.weight)):
        expected_gradient = gradient(other)
        np.testing.assert_allclose(
            gradient(one), expected_gradient, atol=1e-3 * np.abs(expected_gradient).max()
        )
    np.testing.assert_allclose(render(scene, state.detach()), picture.detach(), atol=1e-6)


def test_gradient_through_a_path_tracer(mi):
    from mitex.runtime.jit import dr

    mesh, look = Mesh(QUAD, FACES), random_look("linear", depth=1)
    shape = quad(mi, {"type": "diffuse", "reflectance": properties(look, mesh) | {"raw": True}})
    to_world = mi.ScalarTransform4f().look_at(origin=[0.2, 0.1, 3], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 30, "to_world": to_world, "film": film}
    light = {"type": "directional", "direction": [0.1, 0.2, -1]}
    scene = {"type": "scene", "quad": shape, "sensor": sensor, "light": light}
    scene = mi.load_dict(scene | {"integrator": {"type": "prb", "max_depth": 2}})
    params = mi.traverse(scene)
    keys = [f"quad.bsdf.reflectance.{name}" for name in ("data", "weight_0")]
    starts = [np.array(params[key]) for key in keys]
    dr.enable_grad(*(params[key] for key in keys))
    params.update()
    dr.backward(dr.sum(mi.render(scene, params, spp=256, seed=3).array))
    gradients = [np.array(dr.grad(params[key])) for key in keys]

    def total(key: str, value: np.ndarray) -> float:
        params[key] = upload(mi.TensorXf, value.astype(np.float32))
        params.update()
        return float(np.array(mi.render(scene, spp=256, seed=3), np.float64).sum())

    # Along the gradient: elsewhere slopes cancel, and it shows that its samples are not the picture's.
    for key, start, of_parameter in zip(keys, starts, gradients, strict=True):
        change = 0.005 * of_parameter / np.linalg.norm(of_parameter)
        slope = (total(key, start + change) - total(key, start - change)) / 2
        total(key, start)
        assert slope == pytest.approx(float((of_parameter * change).sum()), rel=5e-3)


def test_channel_selects(mi, points):
    options = {"channel": 2, "raw": True, "scale": 2.0, "offset": 0.1}
    bsdf = {"type": "diffuse", "reflectance": constant(mi, [0.1, 0.2, 0.3], **options)}
    np.testing.assert_allclose(radiance(mi, quad(mi, bsdf), *points), 0.7, atol=1e-6)
