"""The shell around a mesh: what lies in it, and what does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mitex.colour import srgb_to_linear
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.nerf.config import PRESETS
from mitex.methods.nerf.field.decoder import Decoder, Reflection
from mitex.methods.nerf.field.lighting import to_display
from mitex.methods.nerf.field.mlp import weight_bound
from mitex.methods.nerf.field.networks import weight_shapes
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.field.shell import Shell, ShellCoords, appearance, shell_cells, shell_reach
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.methods.nerf.synthesis.maps import LatentMaps, MappedLatents
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

init()


def ball(frequency: int = 12) -> Mesh:
    mesh = icosphere(frequency)
    return Mesh(0.6 * mesh.vertices, mesh.faces)


def square(size: float = 1.0, side: int = 8, seed: int = 0) -> LatentMaps:
    """Maps in which channel k is `size` times (column + 100 row + k)."""
    row, column, k = np.mgrid[0:side, 0:side, 0:24]
    turns = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3, 3)))[0]
    frame = np.random.default_rng(1).integers(0, 3, (side, side))
    values = (size * (column + 100 * row + k)).astype(np.float32)
    return LatentMaps(values, frame.astype(np.int32), turns.astype(np.float32), 0.01)


def triangle(uv) -> MappedLatents:
    axes = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    return MappedLatents(square(), np.array([uv], np.float32), axes[None])


def at(barycentric) -> ShellCoords:
    count = len(barycentric)
    zero = np.zeros((count, 3), np.float32)
    return ShellCoords(
        channels(mi.Point3f, zero),
        upload(mi.Float, np.zeros(count)),
        upload(mi.UInt32, np.zeros(count, np.uint32)),
        channels(mi.Point2f, np.array(barycentric)),
        channels(mi.Vector3f, zero),
    )


def shell(strength: float = 1.0, scale: float = 1.0) -> Shell:
    rng = np.random.default_rng(0)
    weights = [
        upload(mi.TensorXf, rng.uniform(-1, 1, s).astype(np.float32) * weight_bound(s))
        for s in weight_shapes(PRESETS["fast"])
    ]
    mesh = ball()
    uv = np.random.default_rng(2).uniform(size=(len(mesh.faces), 3, 2))
    frames = np.broadcast_to(np.eye(3), (len(mesh.faces), 3, 3))
    latents = MappedLatents(square(1e-3), uv, frames)
    mask = upload(mi.TensorXu8, np.ones((8, 8, 8), np.uint8))
    light = upload(mi.TensorXf, np.array([4.0, *[0.0] * 15], np.float32))  # even
    return Shell(
        Projection(mesh), latents, Decoder(weights, packed=True), light, 0.1, mask, 0.02, scale, strength
    )


def test_maps_are_bilinear_between_the_centres_of_texels():
    latents = triangle([(0, 0), (1, 0), (0, 1)])
    rng = np.random.default_rng(0)
    place = rng.uniform(0.1, 0.4, (50, 2)).astype(np.float32)
    f, phase = latents(at(place))
    column, row = place[:, 0] * 8 - 0.5, (1 - place[:, 1]) * 8 - 0.5  # row 0 is on top
    for k, values in enumerate((*f, *phase)):
        np.testing.assert_allclose(np.array(values), column + 100 * row + k, rtol=1e-4)
    for ours, theirs in zip(latents.features(at(place)), f, strict=True):
        np.testing.assert_array_equal(np.array(ours), np.array(theirs))


def test_maps_repeat_beyond_their_borders():
    inside, beyond = triangle([(0, 0), (1, 0), (0, 1)]), triangle([(3, -2), (4, -2), (3, -1)])
    place = at([(0.3, 0.2), (0.02, 0.01), (0.01, 0.98)])
    for a, b in zip(inside(place)[0], beyond(place)[0], strict=True):
        np.testing.assert_allclose(np.array(a), np.array(b), atol=2e-2)


def test_frames_are_those_of_equation_4():
    """n = T~ T_s^-1 T_c R, written out for the nearest texel."""
    latents, maps = triangle([(0, 0), (1, 0), (0, 1)]), square()
    axes = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    place = np.array([(0.3, 0.2), (0.6, 0.3), (0.1, 0.85)], np.float32)
    column = np.floor(place[:, 0] * 8).astype(int)
    row = np.floor((1 - place[:, 1]) * 8).astype(int)
    local = np.array([0.3, -0.5, 0.8])
    tangent, bitangent, normal = (rows(axis) for axis in latents.frame(at(place)))
    actual = local[0] * tangent + local[1] * bitangent + local[2] * normal
    expected = [axes.T @ maps.frames[maps.frame[r, c]] @ local for r, c in zip(row, column, strict=True)]
    np.testing.assert_allclose(actual, expected, atol=1e-5)


def test_density_is_zero_outside_and_evaluated_inside():
    one = shell()
    radius = np.array([0.45, 0.55, 0.6, 0.65, 0.75, 0.95], np.float32)
    points = np.stack([np.zeros(6), radius, np.zeros(6)], 1).astype(np.float32)
    density = one.density(points)
    assert (density[[0, 4, 5]] == 0).all() and (density[1:4] > 0).all()
    view = channels(mi.Vector3f, np.tile([0.0, -1.0, 0.0], (6, 1)))
    index, inner_density, colour = one.evaluate(channels(mi.Point3f, points), view)
    np.testing.assert_array_equal(np.array(index), [1, 2, 3])
    np.testing.assert_allclose(np.array(inner_density), density[1:4], rtol=1e-4)
    assert rows(colour).shape == (3, 3) and (rows(colour) >= 0).all()


def surface_appearance(view, light, theta: mi.Float | float = 0.0, detach: bool = False) -> tuple[Any, Any]:
    """Colour and normal of a surface of k_d = 0.2, k_s from 0.1 to 0.7 and this theta."""

    def surface(f, phase, distance):
        reflected = map(mi.Float, (0.1, 0.7, 5.0, theta, 0.4))
        return Reflection(mi.Float(0), mi.Color3f(0.2), *reflected)  # pyright: ignore[reportCallIssue]

    latents = MappedLatents(square(), np.zeros((1, 3, 2), np.float32), np.eye(3)[None])
    decoder: Any = surface
    light = upload(mi.TensorXf, np.array(light, np.float32))
    return appearance(latents, decoder, light, at([(0.2, 0.2)]), view, detach)[1:]


def test_a_surface_shines_more_at_grazing_angles():
    """Seen at 60 degrees to its normal, Schlick's law says that 0.1 + 0.6 / 32 is mirrored."""
    light = [4.0, *[0.0] * 15]
    up = rows(surface_appearance(mi.Vector3f(0, 0, -1), light)[1])[0]
    across = np.cross(up, (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across)
    for angle, mirrored in ((0, 0.1), (60, 0.1 + 0.6 / 32), (90, 0.7), (120, 0.7)):
        turned = -np.cos(np.radians(angle)) * up + np.sin(np.radians(angle)) * across
        colour = surface_appearance(mi.Vector3f(*turned.tolist()), light)[0]
        expected = to_display(upload(mi.Float, 4.0 * (0.2 + mirrored) / np.sqrt(4 * np.pi)))
        np.testing.assert_allclose(rows(colour)[0], np.array(expected)[0], rtol=1e-4)


def test_colours_teach_normals_unless_these_are_detached():
    light = [4.0, 0.9, -0.7, 0.8, *[0.2] * 12]
    view = dr.normalize(mi.Vector3f(0.5, 0.3, -0.8))
    theta = mi.Float(0.3)
    dr.enable_grad(theta)
    assert not dr.grad_enabled(surface_appearance(view, light, theta, detach=True)[0])
    dr.backward(dr.sum(surface_appearance(view, light, theta)[0]))
    more, less = (rows(surface_appearance(view, light, value)[0]).sum() for value in (0.31, 0.29))
    assert abs(more - less) > 5e-3
    np.testing.assert_allclose(np.array(dr.grad(theta)), (more - less) / 0.02, rtol=1e-2)


@pytest.mark.parametrize("mean", [(0.1,), (1.0,), (1.3, 0.8, 0.5)])
def test_reflectances_are_those_that_the_own_light_shows_when_it_is_even(mean):
    """Of an even light that shows a white surface as the own one does, the own colours are sent back."""
    one = shell()
    light = np.zeros((16, len(mean)), np.float32)
    light[0] = np.sqrt(4 * np.pi) * np.array(mean)
    one.light = upload(mi.TensorXf, light)
    points = channels(mi.Point3f, (np.eye(3) * (0.57, 0.6, 0.63)).astype(np.float32))
    view = channels(mi.Vector3f, -np.eye(3, dtype=np.float32))
    _, _, colour = one.evaluate(points, view)
    _, phong = one.reflection(points, view)
    white = srgb_to_linear(np.array(mean) ** (1 / 2.4))
    assert (rows(phong.diffuse) >= 0).all()
    back = rows(phong.diffuse) + np.array(phong.specular)[:, None]
    np.testing.assert_allclose(back * white, srgb_to_linear(rows(colour)), rtol=1e-3)


def test_a_larger_texture_is_as_opaque_in_all():
    """Twice the size at twice the distance: half the density, over twice the way."""
    small, large = shell(), shell(scale=2.0, strength=3.0)
    # Above the middle of a face: at a vertex rounding decides which face's features are read.
    middle = ball().vertices[ball().faces[1000]].mean(0)
    out = middle / np.linalg.norm(middle)
    heights = np.array([[0.0], [0.02], [0.04]])
    points, moved = ((middle + way * out).astype(np.float32) for way in (heights, 2 * heights))
    np.testing.assert_allclose(large.density(moved), 1.5 * small.density(points), rtol=1e-3)


def test_nothing_in_the_shell_is_no_error():
    far = channels(mi.Point3f, np.array([[0.95, 0, 0]], np.float32))
    index, density, _ = shell().evaluate(far, channels(mi.Vector3f, np.array([[1, 0, 0]], np.float32)))
    assert len(np.array(index)) == len(np.array(density)) == 0


def test_cells_of_the_shell_hold_it():
    cells = shell_cells(Projection(ball(), reach=0.1), 0.1, np.ones((32, 32, 32), bool))
    axis = (np.arange(32) + 0.5) / 16 - 1
    radius = np.linalg.norm(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1), axis=-1)
    reach = np.sqrt(3) / 32
    assert cells[np.abs(radius - 0.6) < 0.09].all()
    assert not cells[np.abs(radius - 0.6) > 0.1 + 4 * reach].any()


@pytest.mark.parametrize("height", [0.0, 0.004, 0.0156])
def test_a_shell_thinner_than_a_cell_is_not_lost_between_their_centres(height):
    side, thickness = 64, 0.004
    flat = grid(8, 8)
    flat = flat.with_vertices(0.8 * flat.vertices + np.array([0.0, 0.0, height]))
    projection = Projection(flat, repulsion=None, reach=shell_reach(thickness, side))
    cells = shell_cells(projection, thickness, np.ones((side,) * 3, bool))
    rng = np.random.default_rng(0)
    points = np.column_stack(
        [rng.uniform(-0.8, 0.8, (2000, 2)), height + rng.uniform(-1, 1, 2000) * thickness]
    )
    assert cells[tuple(np.floor((points + 1) * (side / 2)).astype(int).T)].all()
