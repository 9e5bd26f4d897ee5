"""decoded_field: values, slopes and gradients against torch's decoder, and continuity."""

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, icosphere
from mitex.methods.nca.decoder.surface import Surface
from mitex.methods.nerf.field.tensors import channels as as_channels
from mitex.runtime.upload import upload
from mitex.scenes.shapes import mesh_shape
from mitex.textures.interpolation import Kind
from tests.scenes.helpers import gradient
from tests.textures.decoded import (
    CASES,
    EVERY,
    UNEVEN,
    layers,
    properties,
    random_look,
    random_points,
    random_state,
    values,
)
from tests.textures.helpers import interaction


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
    weighted = [v * upload(mi.Float, u) for v, u in zip(channels, upstream.T, strict=True)]
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
    upstream = rng.normal(size=(7, 200)).astype(np.float32)
    dr.enable_grad(params[name])
    params.update()
    channels = texture.gather(texture.locate(si))
    weighted = [v * upload(mi.Float, u) for v, u in zip(channels, upstream, strict=True)]
    dr.backward(dr.sum(dr.sum(mi.ArrayXf(weighted))))
    start, slopes = np.array(params[name]), np.array(dr.grad(params[name]))
    # Uphill in every number, so that none makes up for another.
    direction = np.sign(slopes) * np.abs(rng.normal(size=start.shape).astype(np.float32))

    def total(step: float) -> float:
        params[name] = upload(mi.TensorXf, start + np.float32(step) * direction)
        params.update()
        channels = texture.gather(texture.locate(si))
        dr.eval(channels)  # in one kernel
        return float((np.array(channels, np.float64) * upstream).sum())

    measured = (total(1e-3) - total(-1e-3)) / 2e-3
    assert measured == pytest.approx(float((slopes * direction).sum()), rel=2e-2) and measured > 0


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
        out = sign * out / np.linalg.norm(out, axis=1, keepdims=True)
        si.dp_du = as_channels(mi.Vector3f, out)
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
    si.dp_du = as_channels(mi.Vector3f, corners[:, 1] - corners[:, 0])
    si.dp_dv = as_channels(mi.Vector3f, corners[:, 2] - corners[:, 1])
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
