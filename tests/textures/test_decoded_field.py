"""decoded_field: values and gradients against torch's decoder, continuity, use in BSDFs and integrators."""

import numpy as np
import pytest
import torch
from torch import nn

from mitex.bridge import render
from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.mesh import Mesh, icosphere, scattered_sphere
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.decoder import OFFSET, Decoder
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.methods.nca.field import fields
from mitex.methods.nca.look import Look
from mitex.methods.nca.views import render_views
from mitex.runtime.upload import upload
from mitex.scenes import random_views
from mitex.scenes.shapes import mesh_shape
from mitex.scenes.stage import Stage
from mitex.textures.interpolation import Kind
from tests.scenes.helpers import gradient
from tests.textures.helpers import FACES, QUAD, interaction, quad, radiance, sphere_picture

MAPS = ("albedo", "height", "normal")  # 7 channels; height is number 3
EVERY = ("waves", "barycentrics", "polynomials")
CASES: list[tuple[Kind, tuple[str, ...]]] = [
    ("smooth", EVERY),
    ("smooth", ("polynomials", "waves")),
    ("linear", ("waves",)),
    ("linear", ()),
]
UNEVEN = scattered_sphere(60)


def random_look(interpolation: Kind = "smooth", coordinates: tuple[str, ...] = (), seed: int = 0) -> Look:
    config = NcaConfig(interpolation=interpolation, coordinates=coordinates, decoder_width=16)
    look = Look.of(config, MAPS)
    look.initialise(torch.Generator().manual_seed(seed), 0.5)
    return look


def layers(look: Look) -> list[nn.Linear]:
    assert isinstance(look.decoder, Decoder)
    return look.decoder.network.linear


def random_state(mesh: Mesh) -> torch.Tensor:
    return 0.4 * torch.randn(len(mesh.vertices), 16, generator=torch.Generator().manual_seed(1))


def random_points(mesh: Mesh, count: int = 200) -> Points:
    rng = np.random.default_rng(2)
    face = torch.from_numpy(rng.integers(0, len(mesh.faces), count).astype(np.int32))
    return Points(face, torch.from_numpy(rng.dirichlet((1, 1, 1), count).astype(np.float32)))


def properties(
    look: Look, mesh: Mesh = UNEVEN, state: torch.Tensor | None = None, name: str = "albedo"
) -> dict:
    return fields(look, random_state(mesh) if state is None else state, mesh)[name]


def values(mi, texture, mesh: Mesh, face, barycentric) -> np.ndarray:
    """(P, K) values of all channels."""
    from mitex.runtime.jit import dr

    shape = mesh_shape(mesh)
    si = interaction(mi, shape, np.asarray(face), np.asarray(barycentric))
    channels = texture.gather(texture.locate(si))
    dr.eval(channels)  # in one kernel, which takes most of the time
    return np.array(channels).T


def constant(mi, value: list[float], data: np.ndarray | None = None, **options) -> dict:
    """On the quad: one linear layer, of the states (4, 3) if given, plus a constant."""
    weight = np.zeros((len(value), 3)) if data is None else np.eye(3)
    tensors = {
        "data": np.zeros((4, 3)) if data is None else data,
        "vertices": QUAD,
        "faces": FACES,
        "weight_0": weight,
        "bias_0": np.array(value),
    }
    tensors = {name: upload(mi.TensorXf, np.asarray(tensor, np.float32)) for name, tensor in tensors.items()}
    return {"type": "decoded_field"} | tensors | options


@pytest.mark.parametrize(("interpolation", "coordinates"), CASES)
@pytest.mark.parametrize("mesh", [icosphere(3), UNEVEN], ids=["even", "uneven"])
def test_values_are_those_of_torch(mi, mesh, interpolation: Kind, coordinates: tuple[str, ...]):
    look, state, points = random_look(interpolation, coordinates), random_state(mesh), random_points(mesh)
    surface = Surface(mesh, look.interpolation)
    with torch.no_grad():
        expected = look.decoder(surface, surface.table(state), points).numpy()
    texture = mi.load_dict(properties(look, mesh, state))
    np.testing.assert_allclose(
        values(mi, texture, mesh, points.face, points.barycentric), expected, atol=1e-5
    )
    assert expected.std(0).min() > 5e-3


@pytest.mark.parametrize(("interpolation", "coordinates"), [("smooth", EVERY), ("linear", ("waves",))])
def test_gradients_are_those_of_torch(mi, rng, interpolation: Kind, coordinates: tuple[str, ...]):
    from mitex.runtime.jit import dr

    mesh, look = UNEVEN, random_look(interpolation, coordinates)
    points, state = random_points(mesh), random_state(mesh).requires_grad_()
    surface = Surface(mesh, look.interpolation)
    upstream = rng.normal(size=(200, 7)).astype(np.float32)
    (look.decoder(surface, surface.table(state), points) * torch.from_numpy(upstream)).sum().backward()

    texture = mi.load_dict(properties(look, mesh, state))
    params = mi.traverse(texture)
    expected = {"data": gradient(state)}
    for k, layer in enumerate(layers(look)):
        expected |= {f"weight_{k}": gradient(layer.weight), f"bias_{k}": gradient(layer.bias)}
    for name in expected:
        dr.enable_grad(params[name])
    params.update()
    shape = mesh_shape(mesh)
    si = interaction(mi, shape, points.face.numpy(), points.barycentric.numpy())
    channels = texture.gather(texture.locate(si))
    weighted = [v * mi.Float(u) for v, u in zip(channels, upstream.T, strict=True)]
    dr.backward(dr.sum(dr.sum(mi.ArrayXf(weighted))))
    for name, value in expected.items():
        np.testing.assert_allclose(np.array(dr.grad(params[name])), value, atol=1e-4 * np.abs(value).max())


@pytest.mark.parametrize("name", ["data", "weight_0", "bias_1", "weight_3"])
def test_gradients_are_finite_differences(mi, rng, name: str):
    from mitex.runtime.jit import dr

    texture = mi.load_dict(properties(random_look("smooth", EVERY)))
    points = random_points(UNEVEN)
    shape = mesh_shape(UNEVEN)
    si = interaction(mi, shape, points.face.numpy(), points.barycentric.numpy())
    params = mi.traverse(texture)
    start = np.array(params[name])
    direction = rng.normal(size=start.shape).astype(np.float32)
    upstream = rng.normal(size=(7, 200))

    def total(step: float) -> float:
        params[name] = mi.TensorXf(start + step * direction)
        params.update()
        return float((np.array(texture.gather(texture.locate(si)), np.float64) * upstream).sum())

    slope = (total(1e-3) - total(-1e-3)) / 2e-3
    params[name] = mi.TensorXf(start)
    dr.enable_grad(params[name])
    params.update()
    channels = texture.gather(texture.locate(si))
    weighted = [v * mi.Float(u) for v, u in zip(channels, upstream, strict=True)]
    dr.backward(dr.sum(dr.sum(mi.ArrayXf(weighted))))
    expected = float((np.array(dr.grad(params[name])) * direction).sum())
    assert slope == pytest.approx(expected, rel=2e-2)


def sides(mesh: Mesh, t: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Both faces (E,) along each edge, and the barycentrics there (E, 3) of the point at `t` on it."""
    first: dict[tuple[int, int], tuple[int, int]] = {}
    for face, corners in enumerate(mesh.faces.tolist()):
        first |= {(corners[k], corners[(k + 1) % 3]): (face, k) for k in range(3)}
    edges = [edge for edge in first if edge[0] < edge[1]]
    both = []
    for ends, place in ((edges, t), ([(b, a) for a, b in edges], 1 - t)):
        face, corner = np.array([first[edge] for edge in ends]).T
        barycentric = np.zeros((len(edges), 3), np.float32)
        barycentric[np.arange(len(edges)), corner] = 1 - place
        barycentric[np.arange(len(edges)), (corner + 1) % 3] = place
        both.append((face, barycentric))
    return both


@pytest.mark.parametrize(("interpolation", "coordinates"), CASES)
def test_faces_agree_on_edges_and_vertices(mi, interpolation: Kind, coordinates: tuple[str, ...]):
    texture = mi.load_dict(properties(random_look(interpolation, coordinates)))
    for t in (0.0, 1e-20, 1e-6, 0.3, 0.5, 1.0):
        left, right = (values(mi, texture, UNEVEN, *side) for side in sides(UNEVEN, t))
        np.testing.assert_allclose(left, right, atol=1e-6)


def across(mi, texture, mesh: Mesh, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of the channel from the left to the right of each edge, as both faces have them."""
    slopes = []
    for sign, (face, barycentric) in zip((1, -1), sides(mesh, t), strict=True):
        ends = np.sort(np.argsort(barycentric, axis=1)[:, 1:], axis=1)
        ends = np.where((ends == [0, 2]).all(axis=1, keepdims=True), [2, 0], ends)
        a, b = (mesh.vertices[mesh.faces[face, ends[:, k]]] for k in range(2))
        out = np.cross(b - a, mesh.face_normals[face])
        shape = mesh_shape(mesh)
        si = interaction(mi, shape, face, barycentric)
        si.dp_du = mi.Vector3f(sign * (out / np.linalg.norm(out, axis=1, keepdims=True)).T)
        si.dp_dv = mi.Vector3f(0)
        slopes.append(texture.eval_1_grad(si).x.numpy())
    return slopes[0], slopes[1]


def test_smooth_slopes_do_not_jump_at_edges(mi):
    smooth, linear = (mi.load_dict(properties(random_look(kind))) for kind in ("smooth", "linear"))
    for t in (0.2, 0.5):
        left, right = across(mi, smooth, UNEVEN, t)
        np.testing.assert_allclose(left, right, atol=2e-5 * np.abs(left).max())
        left, right = across(mi, linear, UNEVEN, t)
        assert np.abs(left - right).max() > 0.1 * np.abs(left).max()


@pytest.mark.parametrize(("interpolation", "coordinates"), CASES)
def test_slopes_are_finite_differences(mi, interpolation: Kind, coordinates: tuple[str, ...]):
    texture = mi.load_dict(properties(random_look(interpolation, coordinates), name="height"))
    face = random_points(UNEVEN).face.numpy()
    barycentric = np.random.default_rng(3).dirichlet((3, 3, 3), len(face)).astype(np.float32)
    corners = UNEVEN.vertices[UNEVEN.faces[face]]
    shape = mesh_shape(UNEVEN)
    si = interaction(mi, shape, face, barycentric)
    si.dp_du = mi.Vector3f((corners[:, 1] - corners[:, 0]).T)
    si.dp_dv = mi.Vector3f((corners[:, 2] - corners[:, 1]).T)
    step = 1 / 512
    slopes = np.array(texture.eval_1_grad(si))
    for slope, way in zip(slopes, ([-1, 1, 0], [0, -1, 1]), strict=True):
        ahead, behind = (
            values(mi, texture, UNEVEN, face, barycentric + s * np.array(way, np.float32))[:, 3]
            for s in (step, -step)
        )
        expected = (ahead - behind) / (2 * step)
        # A sorted barycentric may change its place between the two.
        assert np.quantile(np.abs(slope - expected), 0.9) < 0.02 * np.abs(expected).max()


def test_slopes_have_gradients(mi, rng):
    """So that relief can be learned from pictures."""
    from mitex.runtime.jit import dr

    texture = mi.load_dict(properties(random_look("smooth", ("waves",))))
    points, shape = random_points(UNEVEN), mesh_shape(UNEVEN)
    si = interaction(mi, shape, points.face.numpy(), points.barycentric.numpy())
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 0.6, 0.8)
    params = mi.traverse(texture)
    start = np.array(params["data"])
    direction = rng.normal(size=start.shape)
    dr.enable_grad(params["data"])
    params.update()
    dr.backward(dr.sum(dr.squared_norm(texture.eval_1_grad(si))))
    of_data = np.array(dr.grad(params["data"]))

    def total(step: float) -> float:
        params["data"] = upload(mi.TensorXf, (start + step * direction).astype(np.float32))
        params.update()
        return float((np.array(texture.eval_1_grad(si), np.float64) ** 2).sum())

    slope = (total(1e-3) - total(-1e-3)) / 2e-3
    assert slope == pytest.approx(float((of_data * direction).sum()), rel=2e-2)


def test_order_of_vertices_and_faces_does_not_matter(mi, rng):
    look, points = random_look("smooth", EVERY), random_points(UNEVEN)
    face, barycentric = points.face.numpy(), points.barycentric.numpy()
    texture = mi.load_dict(properties(look))
    expected = values(mi, texture, UNEVEN, face, barycentric)

    order, turn = rng.permutation(len(UNEVEN.vertices)), rng.integers(0, 3, len(UNEVEN.faces))
    place, columns = np.argsort(order), (np.arange(3) + turn[:, None]) % 3
    shuffled = Mesh(UNEVEN.vertices[order], np.take_along_axis(place[UNEVEN.faces], columns, axis=1))
    other = mi.load_dict(properties(look, shuffled, random_state(UNEVEN)[torch.from_numpy(order)]))
    turned = np.take_along_axis(barycentric, columns[face], axis=1)
    np.testing.assert_allclose(values(mi, other, shuffled, face, turned), expected, atol=1e-5)

    faces = rng.permutation(len(UNEVEN.faces))  # of the shape alone
    shape = Mesh(UNEVEN.vertices, UNEVEN.faces[faces])
    found = values(mi, texture, shape, np.argsort(faces)[face], barycentric)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_texture_stays_on_a_shape_that_moves(mi):
    texture, points = mi.load_dict(properties(random_look("smooth", EVERY))), random_points(UNEVEN)
    moved = UNEVEN.with_vertices(3 * UNEVEN.vertices[:, [1, 2, 0]] + 5)
    still, carried = (values(mi, texture, m, points.face, points.barycentric) for m in (UNEVEN, moved))
    np.testing.assert_array_equal(still, carried)


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
    """Albedo and roughness of a principled BSDF in a path-traced picture."""
    mesh, look = icosphere(4), random_look("smooth", EVERY)
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


@pytest.mark.parametrize("name", ["data", "weight_0"])
def test_gradient_through_a_path_tracer(mi, name: str, rng):
    from mitex.runtime.jit import dr

    mesh, look = Mesh(QUAD, FACES), random_look("smooth", ("waves",))
    shape = quad(mi, {"type": "diffuse", "reflectance": properties(look, mesh) | {"raw": True}})
    to_world = mi.ScalarTransform4f().look_at(origin=[0.2, 0.1, 3], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 30, "to_world": to_world, "film": film}
    light = {"type": "directional", "direction": [0.1, 0.2, -1]}
    scene = {"type": "scene", "quad": shape, "sensor": sensor, "light": light}
    scene = mi.load_dict(scene | {"integrator": {"type": "prb", "max_depth": 2}})
    params = mi.traverse(scene)
    key = f"quad.bsdf.reflectance.{name}"
    start = np.array(params[key])
    dr.enable_grad(params[key])
    params.update()
    dr.backward(dr.sum(mi.render(scene, params, spp=64, seed=3).array))
    of_parameter = np.array(dr.grad(params[key]))
    direction = rng.normal(size=start.shape)

    def total(step: float) -> float:
        params[key] = upload(mi.TensorXf, (start + step * direction).astype(np.float32))
        params.update()
        return float(np.array(mi.render(scene, spp=64, seed=3), np.float64).sum())

    slope = (total(2e-3) - total(-2e-3)) / 4e-3
    assert slope == pytest.approx(float((of_parameter * direction).sum()), rel=2e-2)


def test_mean_and_max_go_over_the_vertices(mi):
    look = random_look("smooth", EVERY)
    texture = mi.load_dict(properties(look))
    corner = [(face, k) for v in range(60) for face, k in [np.argwhere(UNEVEN.faces == v)[0]]]
    face, k = np.array(corner).T
    colours = srgb_to_linear(values(mi, texture, UNEVEN, face, np.eye(3)[k])[:, :3].clip(0, 1))
    assert texture.mean()[0] == pytest.approx(colours.mean(), rel=1e-4)
    assert texture.max() == pytest.approx(colours.max(), rel=1e-4)
    assert texture.is_spatially_varying()


def test_channel_selects(mi, points):
    options = {"channel": 2, "raw": True, "scale": 2.0, "offset": 0.1}
    bsdf = {"type": "diffuse", "reflectance": constant(mi, [0.1, 0.2, 0.3], **options)}
    np.testing.assert_allclose(radiance(mi, quad(mi, bsdf), *points), 0.7, atol=1e-6)


def test_to_string(mi):
    text = str(mi.load_dict(properties(random_look("linear", ("waves", "polynomials")))))
    assert text.startswith("DecodedField[\n  vertices = 60,\n  states = 16,\n  channels = 7,\n")
    assert "interpolation = linear,\n  coordinates = waves polynomials,\n  channel = 0" in text


def tensor(*shape: int, value: float = 0.0):
    return lambda mi: upload(mi.TensorXf, np.full(shape, value, np.float32))


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"chanel": 1}, "chanel"),
        ({"channel": 3}, "use 0 to 2"),
        ({"channel": -1}, "use 0 to 2"),
        ({"data": None}, "data"),
        ({"data": tensor(3, 3)}, r"'data' has shape \(3, 3\); give one of shape \(4, C\)"),
        ({"data": tensor(4, 0)}, "'data' has shape"),
        ({"data": tensor(4)}, "'data' has shape"),
        ({"data": tensor(4, 2)}, "3 inputs, but state and coordinates are 2"),
        ({"coordinates": "polynomials"}, "3 inputs, but state and coordinates are 5"),
        ({"coordinates": "waves"}, "waves"),
        ({"coordinates": "waves", "waves": tensor(2, 3)}, r"'waves' has shape \(2, 3\)"),
        ({"coordinates": "wave"}, "'wave'; use some of waves, barycentrics, polynomials"),
        ({"interpolation": "cubic"}, "'cubic'; use smooth or linear"),
        ({"vertices": None}, "vertices"),
        ({"vertices": tensor(4, 2)}, "the mesh at rest"),
        ({"vertices": tensor(4, 3, value=np.nan)}, "the mesh at rest"),
        ({"faces": tensor(2, 3, value=4)}, "the mesh at rest"),
        ({"faces": tensor(2, 3, value=0.5)}, "the mesh at rest"),
        ({"faces": tensor(2, 3, value=np.nan)}, "the mesh at rest"),
        ({"faces": tensor(2, 4)}, "the mesh at rest"),
        ({"weight_0": None}, "pairs"),
        ({"bias_0": None}, "bias_0"),
        ({"weight_0": tensor(3)}, r"'weight_0' has shape \(3,\)"),
        ({"weight_0": tensor(0, 3)}, r"'weight_0' has shape \(0, 3\)"),
        ({"bias_0": tensor(2)}, r"'bias_0' has shape \(2,\); give \(3,\)"),
        ({"weight_1": tensor(3, 4), "bias_1": tensor(3)}, "has 4 inputs, but the layer before gives 3"),
    ],
)
def test_bad_properties_are_refused(mi, options: dict, problem: str):
    options = {name: value(mi) if callable(value) else value for name, value in options.items()}
    plugin = constant(mi, [0.0] * 3) | options
    with pytest.raises(RuntimeError, match=problem):
        mi.load_dict({name: value for name, value in plugin.items() if value is not None})


@pytest.mark.parametrize(("name", "shape"), [("data", (5, 3)), ("weight_0", (3, 2)), ("bias_0", (4,))])
def test_bad_updates_are_refused(mi, name: str, shape: tuple[int, ...]):
    params = mi.traverse(mi.load_dict(constant(mi, [0.0] * 3)))
    params[name] = upload(mi.TensorXf, np.zeros(shape, np.float32))
    with pytest.raises(ConfigError, match=name):
        params.update()


def test_other_shapes_read_nothing(mi):
    field = constant(mi, [0.5] * 3, raw=True, offset=0.1)
    ball = mi.load_dict({"type": "sphere", "radius": 2.0, "bsdf": {"type": "diffuse", "reflectance": field}})
    scene = mi.load_dict({"type": "scene", "ball": ball})
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0.1, 0.2, 3), mi.Vector3f(0, 0, -1)))
    np.testing.assert_allclose(si.bsdf().eval_diffuse_reflectance(si)[0].numpy(), 0.1, atol=1e-6)


def test_other_variants(mi, points):
    """Mono shows luminance; scalar is refused."""
    before = mi.variant()
    try:
        mi.set_variant("llvm_ad_mono")
        texture = constant(mi, [0.2, 0.5, 0.7], raw=True)
        value = radiance(mi, quad(mi, {"type": "diffuse", "reflectance": texture}), *points)
        np.testing.assert_allclose(value, 0.2 * 0.212671 + 0.5 * 0.715160 + 0.7 * 0.072169, atol=1e-5)
        mi.set_variant("scalar_rgb")
        with pytest.raises(RuntimeError, match="llvm"):
            mi.load_dict(constant(mi, [0.0] * 3))
    finally:
        mi.set_variant(before)
