"""Boxes on a mesh: where they stand, which one a point belongs to, and what rays gather in them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from mitex.cli import main
from mitex.errors import CheckpointError, ConfigError, MeshError
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.baselines.nerf_tex import PRESETS, NerfTexConfig, NerfTexTexture, fit, instances
from mitex.methods.baselines.nerf_tex.anchors import Anchors, place_anchors
from mitex.methods.baselines.nerf_tex.box import (
    main_direction,
    most_typical,
    picture_box,
    possible_cells,
    take_box,
)
from mitex.methods.baselines.nerf_tex.boxes import Boxes
from mitex.methods.baselines.nerf_tex.instances import InstancedField
from mitex.methods.baselines.nerf_tex.networks import FrequencyNetwork, HashNetwork, Inputs, frequencies
from mitex.methods.baselines.nerf_tex.task import BoxTask
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.field.lighting import rotated, shade
from mitex.methods.nerf.field.rendering import render_rays
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.methods.nerf.synthesis.patches import extract_patches
from mitex.methods.nerf.training.radiance import Rendered
from mitex.methods.nerf.use.placement import EXTENT
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.training.config import resolve
from tests.methods.nerf.small import small_texture

init()
LOW, HIGH = np.array([-0.8, -0.8, -0.3]), np.array([0.8, 0.8, 0.5])
SMALL = ["patch=64", "views=16", "view=16", "rays=256", "ray_steps=64", "table=10", "occupancy=16"]
SMALL += ["average=0.5", "preview_every=0"]


@pytest.fixture(scope="module", autouse=True)
def coarse():
    """Occupied cells are looked for on a coarse grid."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(instances, "FINER", 1)
        patch.setattr(instances, "REFRESHES", 1)
        yield


def random_anchors(count: int, seed: int = 0) -> Anchors:
    rng = np.random.default_rng(seed)
    frames = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    frames[np.linalg.det(frames) < 0, 2] *= -1
    return Anchors(rng.uniform(-0.6, 0.6, (count, 3)).astype(np.float32), frames.astype(np.float32))


def brute_force(anchors: Anchors, half: float, points: np.ndarray, lift: float):
    """Nearest box, number of boxes, and place in the nearest, one box after another."""
    nearest, least = np.full(len(points), -1), np.full(len(points), np.inf)
    overlaps, place = np.zeros(len(points), int), np.zeros((len(points), 3))
    for k, (anchor, frame) in enumerate(zip(anchors.points, anchors.frames, strict=True)):
        local = (points - anchor - lift * frame[2]) @ frame.T / half
        inside = ((local >= LOW) & (local <= HIGH)).all(1)
        overlaps += inside
        distance = np.linalg.norm(local, axis=1)
        closer = inside & (distance < least)
        nearest[closer], least[closer], place[closer] = k, distance[closer], local[closer]
    return nearest, overlaps, place


@pytest.mark.parametrize("lift", [0.0, 0.08])
def test_points_find_their_boxes(lift):
    anchors = random_anchors(60)
    points = np.random.default_rng(1).uniform(-1, 1, (20_000, 3)).astype(np.float32)
    box, overlaps, local = Boxes(anchors, 0.25, LOW, HIGH, lift).nearest(channels(mi.Point3f, points))
    nearest, count, place = brute_force(anchors, 0.25, points, lift)
    border = np.abs(np.concatenate([place - LOW, place - HIGH], 1)).min(1) < 1e-4
    same = np.array(overlaps) == count
    assert (same | border).all() or (~same).sum() <= 4  # of points on a border, floats decide
    inside = same & (count > 0)
    assert count.max() >= 3 and inside.sum() > 2000
    assert (np.array(box)[inside] == nearest[inside]).mean() > 0.999
    agree = inside & (np.array(box) == nearest)
    assert np.abs(rows(local)[agree] - place[agree]).max() < 1e-4


def ball_in_a_box(inputs: Inputs):
    """A ball of density 9 around (0.2, 0, 0.1), in the colours of place, view and light."""
    inside = dr.squared_norm(inputs.points - mi.Point3f(0.2, 0, 0.1)) < 0.25**2
    mixed = mi.Vector3f(inputs.points) * 0.25 + inputs.view * 0.15 + inputs.light * 0.1
    return dr.select(inside, mi.Float(9), 0), mi.Color3f(0.5 + mixed)


def instanced(anchors: Anchors, half: float = 0.3, light=(0.0, 0.6, 0.8)) -> InstancedField:
    boxes = Boxes(anchors, half, LOW, HIGH)
    return InstancedField(boxes, ball_in_a_box, np.ones((8,) * 3, np.uint8), 0.01, np.array(light))


def test_rays_gather_what_a_march_through_all_boxes_does():
    """Against a slow one in NumPy: nearest box of those that a sample is in, density by their number."""
    anchors, half, step, light = random_anchors(12, seed=3), 0.3, 0.01, np.array([0.0, 0.6, 0.8])
    field = instanced(anchors)
    field.mask = upload(mi.TensorXu8, np.ones((16,) * 3, np.uint8))
    rng = np.random.default_rng(5)
    origins = rng.normal(size=(40, 3))
    origins *= 2.5 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.5, 0.5, (40, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    colour, transmittance = render_rays(field, origins.astype(np.float32), directions.astype(np.float32))
    assert (transmittance < 0.5).sum() > 6 and (transmittance == 1).sum() > 2
    for k in range(40):
        expected, passing = march_slowly(anchors, half, step, light, origins[k], directions[k])
        assert transmittance[k] == pytest.approx(passing, abs=0.03)
        assert colour[k] == pytest.approx(expected, abs=0.03)


def march_slowly(anchors, half, step, light, origin, direction):
    with np.errstate(divide="ignore"):
        ends = np.stack([(-1 - origin) / direction, (1 - origin) / direction])
    enter, leave = ends.min(0).max(), ends.max(0).min()
    points = origin + direction * (enter + np.arange(0.5 * step, leave - enter, step)[:, None])
    nearest, overlaps, place = brute_force(anchors, half, points, 0.0)
    total, passing = np.zeros(3), 1.0
    for box, count, local in zip(nearest, overlaps, place, strict=True):
        if count and np.sum((local - [0.2, 0, 0.1]) ** 2) < 0.25**2:
            frame = anchors.frames[box]
            shown = 0.5 + 0.25 * local + 0.15 * frame @ direction + 0.1 * frame @ light
            opacity = 1 - math.exp(-9 / half / count * step)
            total += passing * opacity * shown
            passing *= 1 - opacity
    return total, passing


def test_overlaps_divide_the_density():
    """Of k boxes in one place each point has the density of one by k, and that belongs to one of them."""
    one = random_anchors(1)
    points = (one.points + 0.3 * np.array([[0.2, 0, 0.1]]) @ one.frames[0]).astype(np.float32)
    densities = []
    for count in (1, 2, 5):
        same = Anchors(one.points.repeat(count, 0), one.frames.repeat(count, 0))
        densities.append(float(instanced(same).density_at(points)[0]))
    assert densities == pytest.approx([9 / 0.3, 9 / 0.6, 9 / 1.5])


def test_empty_cells_of_a_box_are_empty():
    one = random_anchors(1)
    points = (one.points + 0.3 * np.array([[0.2, 0, 0.1]]) @ one.frames[0]).astype(np.float32)
    occupied = np.zeros((8,) * 3, np.uint8)
    empty = InstancedField(Boxes(one, 0.3, LOW, HIGH), ball_in_a_box, occupied, 0.01, np.array([0, 0, 1]))
    assert empty.density_at(points) == 0 and not np.array(empty.mask).any()


def test_anchors_are_spread():
    ball = icosphere(20)
    anchors = place_anchors(ball, 0.2, 0.0, False, 0)
    gaps = np.linalg.norm(anchors.points[:, None] - anchors.points, axis=2) + 9 * np.eye(len(anchors))
    assert gaps.min() > 0.2
    places = np.random.default_rng(1).normal(size=(3000, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    assert np.linalg.norm(places[:, None] - anchors.points, axis=2).min(1).max() < 0.2 * 1.2
    up = anchors.points / np.linalg.norm(anchors.points, axis=1, keepdims=True)
    assert np.abs(anchors.frames[:, 2] - up).max() < 0.03
    assert np.abs(anchors.frames @ anchors.frames.swapaxes(1, 2) - np.eye(3)).max() < 1e-5
    assert (np.linalg.det(anchors.frames) > 0).all()


def test_both_sides_of_a_thin_plate_get_anchors():
    sheet = grid(12, 12)
    back = Mesh(sheet.vertices - [0, 0, 0.02], sheet.faces[:, ::-1], name="back")
    vertices = np.concatenate([sheet.vertices, back.vertices])
    plate = Mesh(vertices, np.concatenate([sheet.faces, back.faces + len(sheet.vertices)]), name="plate")
    up = place_anchors(plate, 0.3, 0.0, False, 0).frames[:, 2, 2] > 0
    assert 0.4 < up.mean() < 0.6 and up.sum() > 20


def test_tilt_and_turn_change_the_axes():
    sheet = grid(4, 4)
    straight = place_anchors(sheet, 0.1, 0.0, True, 0)
    assert np.abs(straight.frames - np.eye(3)).max() < 1e-6
    turned = place_anchors(sheet, 0.1, 0.0, False, 0)
    assert np.abs(turned.frames[:, 2] - [0, 0, 1]).max() < 1e-6
    angles = np.arctan2(turned.frames[:, 0, 1], turned.frames[:, 0, 0])
    assert abs(np.exp(1j * angles).mean()) < 0.2
    leaning = place_anchors(sheet, 0.1, 0.1, True, 0)
    angles = np.arccos(leaning.frames[:, 2, 2])
    assert angles.std() > 0.03 and np.sqrt(np.mean(angles**2) / 2) == pytest.approx(0.1, rel=0.15)


def test_anchors_are_refused():
    with pytest.raises(MeshError, match="no area"):
        place_anchors(grid(1, 1).with_vertices(np.zeros((4, 3))), 0.1, 0.0, True, 0)
    with pytest.raises(ConfigError, match="boxes on grid; use a larger scale"):
        place_anchors(grid(1, 1), 0.002, 0.0, True, 0)


def test_the_published_network_has_its_layers():
    """The place has 3 + 3 * 2 * 10 values, view and light 3 + 3 * 2 * 4 each."""
    network = FrequencyNetwork()
    layers = [(63, 256), *[(256, 256)] * 4, (256 + 63, 256), (256, 256), (256, 256)]
    layers += [(256, 1), (256, 256), (256 + 27 + 27, 128), (128, 3)]
    assert sum(math.prod(s) for s in network.shapes.values()) == sum(i * o + o for i, o in layers) == 599_300
    trunk = [network.shapes[f"trunk/{k}/weight"] for k in range(8)]
    assert trunk == [(o, i) for i, o in layers[:8]]


def test_frequencies_are_octaves_of_half_a_period():
    values = torch.tensor([[0.25, 0.0, -1.0]])
    encoded = frequencies(values, 2)[0].tolist()
    sines = [math.sin(math.pi * 2**k * v) for k in range(2) for v in (0.25, 0.0, -1.0)]
    assert encoded[:3] == [0.25, 0.0, -1.0]
    assert encoded[3:6] + encoded[9:12] == pytest.approx(sines, abs=1e-6)


@pytest.mark.parametrize("network", [HashNetwork(8), FrequencyNetwork()], ids=["hash", "frequencies"])
def test_networks_know_place_view_and_light(network):
    """Packed and attached they agree; the density depends on the place alone."""
    parameters = network.initial(torch.Generator().manual_seed(0))
    if "table" in parameters:
        with torch.no_grad():
            parameters["table"].mul_(1e4)
    rng = np.random.default_rng(0)
    values = [rng.uniform(-0.9, 0.9, (50, 3)).astype(np.float32) for _ in range(2)]
    units = rng.normal(size=(4, 50, 3))
    units = (units / np.linalg.norm(units, axis=2, keepdims=True)).astype(np.float32)

    def results(points, view, light):
        directions = (channels(mi.Vector3f, values) for values in (view, light))
        inputs = Inputs(channels(mi.Point3f, points), *directions)
        density, colour = network.attached(parameters, inputs)
        fast, shown = network.evaluator(parameters)(inputs)
        np.testing.assert_allclose(np.array(fast), density.detach().numpy(), rtol=2e-2)
        np.testing.assert_allclose(rows(shown), colour.detach().numpy(), atol=1e-2)
        return density, colour

    density, colour = results(values[0], units[0], units[1])
    assert density.shape == (50,) and colour.shape == (50, 3)
    for changed in ((values[0], units[2], units[1]), (values[0], units[0], units[3])):
        other = results(*changed)
        assert torch.allclose(other[0], density, rtol=1e-4)
        assert (other[1] - colour).abs().max() > 1e-3
    assert (results(values[1], units[0], units[1])[0] - density).abs().max() > 1e-4
    (density.sum() + colour.sum()).backward()
    assert all(value.grad is not None and value.grad.abs().sum() > 0 for value in parameters.values())


def captured() -> NerfTexture:
    """The small texture, on a ball with room for pieces."""
    model, ball = small_texture().model, icosphere(30)
    mesh = Mesh(0.6 * ball.vertices, ball.faces, name="ball")
    base = replace(model.base, mesh=mesh, scan=0.58 * ball.vertices)
    return NerfTexture(replace(model, base=base, frames=face_frames(mesh)))


@pytest.fixture(scope="module")
def box():
    return take_box(captured(), 128, 0)


def test_a_piece_lies_in_its_box(box):
    """As wide as `EXTENT`, as thick as the shell, and of the captured size; nothing is beside it."""
    texture = captured()
    base = texture.model.base
    squares = extract_patches(base.mesh, np.random.default_rng(0), count=8, size=128, scan=base.scan)
    assert box.half == pytest.approx(0.5 * squares.length / EXTENT)
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    thick = box.field.thickness
    assert thick == pytest.approx(base.thickness / box.half)
    outside = (np.abs(points[:, :2]) > EXTENT).any(1) | (np.abs(points[:, 2]) > thick)
    density = box.field.density(points)
    assert (density[outside] == 0).all() and (density[~outside] > 0).mean() > 0.99
    filled = np.argwhere(np.array(box.field.mask))
    cells = possible_cells(box, 24)
    places = (filled + np.random.default_rng(1).random(filled.shape)) * (24 / len(box.field.mask))
    assert cells[tuple(places.astype(int).T)].all() and not cells.all()


def test_the_most_typical_piece_is_taken():
    """Of squares whose features are their places, the one nearest to the middle of all."""
    ball = icosphere(12)
    squares = extract_patches(ball, np.random.default_rng(0), count=40, size=16)
    texture: Any = type("Places", (), {"features": staticmethod(lambda p: np.tile(p, (1, 8)))})()
    means = squares.points[:, ::8, ::8].mean((1, 2))
    assert most_typical(texture, squares) == np.linalg.norm(means - means.mean(0), axis=1).argmin()


def test_boxes_that_hold_nothing_are_refused():
    with pytest.raises(ConfigError, match="raise `patch` to"):
        take_box(captured(), 16, 0)


def test_most_light_comes_from_its_main_direction():
    """The side of a ball that faces there is brightest, however the light is turned."""
    rng = np.random.default_rng(0)
    light = np.zeros(16)
    light[:4] = 4.0, *rng.normal(size=3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    normals = icosphere(20).vertices.astype(np.float32)
    for coefficients, direction in (
        (light, main_direction(light)),
        (rotated(light, turn), turn @ main_direction(light)),
    ):
        normal, one = channels(mi.Vector3f, normals), mi.Float(1)
        shown = shade(
            normal, -normal, one, one * 0, one, upload(mi.TensorXf, coefficients.astype(np.float32))
        )
        assert normals[rows(shown)[:, 0].argmax()] @ direction > 0.99
    assert main_direction(np.array([4.0] + [0.0] * 15)).tolist() == [0, 0, 1]


def test_pictures_show_the_box_under_turned_lights(box):
    pictures, lights = picture_box(box, 5, 8, 0)
    assert len(pictures) == 5 and lights.shape == (5, 3)
    assert np.abs(np.linalg.norm(lights, axis=1) - 1).max() < 1e-5
    assert (pictures.poses[:, 2, 3] > 0).all()
    middle = np.array([[4.0, 4.0]])
    for view in range(5):
        origins, directions = pictures.rays(view, middle)
        assert np.abs(np.cross(origins[0], directions[0])).max() < 1e-4  # it looks at the middle
        assert pictures.images[view][..., 3].max() > 100 and pictures.images[view][0, 0, 3] == 0
    again, turned = picture_box(box, 5, 8, 0)[0], picture_box(box, 5, 8, 1)[1]
    assert (again.images[3] == pictures.images[3]).all() and np.abs(turned - lights).max() > 0.1


@pytest.mark.parametrize(("loss", "relative"), [("l1", 0.2 / 0.61), ("l2", 5 * (0.2 / 0.61) ** 2)])
def test_colours_are_compared_where_something_is(loss, relative):
    """Relative differences where alpha is above 0, squared ones of the opacity everywhere."""
    colour = torch.tensor([[0.5, 0.2, 0.0], [0.3, 0.3, 0.3]])
    batch: Any = type("Batch", (), {})()
    batch.colours, batch.alpha = (
        torch.tensor([[0.5, 0.4, 0.0], [0.9, 0.9, 0.9]]),
        torch.tensor([[1.0], [0.0]]),
    )
    rendered: Any = object.__new__(Rendered)
    rendered.colour, rendered.transmittance = colour, torch.tensor([0.5, 0.8])
    task = object.__new__(BoxTask)
    task.config = NerfTexConfig(colour_loss=loss)
    error = task.error(rendered, batch, torch.zeros(2, 3))
    assert error.item() == pytest.approx(relative / 3 + (0.5**2 + 0.2**2) / 2)


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boxes") / "run"
    fit(captured(), folder, steps=40, set=[*SMALL, "patch=128", "lr=0.002"])
    return folder


def test_a_fit_learns_its_box(run_folder):
    """The loss falls, and the box stays in its bounds."""
    lines = (run_folder / "metrics.jsonl").read_text().splitlines()
    losses = [float(line.split('"loss": ')[1].split(",")[0]) for line in lines]
    assert np.mean(losses[-5:]) < 0.9 * losses[0]
    low, high = NerfTexTexture.load(run_folder).bounds
    assert (low >= -1).all() and (high <= 1).all() and np.abs(low[:2]).max() <= EXTENT


def test_a_texture_survives_saving(run_folder, tmp_path):
    texture = NerfTexTexture.load(run_folder)
    again = NerfTexTexture.load(texture.save(tmp_path / "copy.safetensors"))
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3)).astype(np.float32)
    ball = icosphere(4)
    densities = [t.apply(ball, spacing=1.0).density(points) for t in (texture, again)]
    assert (densities[0] == densities[1]).all() and densities[0].any()
    assert dict(again.about) == dict(texture.about)


@pytest.mark.parametrize(
    "change",
    [
        {"scale": 1.5},
        {"spacing": 0.8},
        {"tilt": 20.0},
        {"aligned": True},
        {"lift": 0.0},
        {"density": 2.0},
        {"seed": 1},
    ],
)
def test_every_option_changes_the_boxes(run_folder, change):
    texture, ball = NerfTexTexture.load(run_folder), icosphere(4)
    points = np.random.default_rng(0).uniform(-0.95, 0.95, (4000, 3)).astype(np.float32)
    plain, other = (
        texture.apply(ball, spacing=1.0).density(points),
        texture.apply(ball, **{"spacing": 1.0} | change).density(points),
    )
    assert plain.any() and (plain != other).any()


def test_what_is_solid_is_around_the_mesh(run_folder):
    applied = NerfTexTexture.load(run_folder).apply(icosphere(4), spacing=1.5, density=300.0)
    mesh = applied.surface.mesh
    radii = np.linalg.norm(mesh.vertices, axis=1)
    assert 0.9 < np.median(radii) < 1.6 and len(mesh.faces) > 100
    assert applied.surface.maps["albedo"].std(0).max() > 0.01


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"scale": 0.01}, "`scale` 0.01 is out of range"),
        ({"scale": math.nan}, "`scale` nan is out of range"),
        ({"spacing": 0.05}, "`spacing` 0.05 is out of range"),
        ({"tilt": 50.0}, "`tilt` 50 is out of range"),
        ({"lift": 2.0}, "`lift` 2 is out of range"),
        ({"density": 0.0}, "`density` 0 is out of range"),
    ],
)
def test_options_out_of_range_are_refused(run_folder, options, why):
    with pytest.raises(ConfigError, match=why):
        NerfTexTexture.load(run_folder).apply(icosphere(2), **options)


def test_an_empty_box_is_refused(run_folder):
    texture = NerfTexTexture.load(run_folder)
    empty = replace(texture, occupied=np.zeros_like(texture.occupied))
    with pytest.raises(ConfigError, match="is empty"):
        empty.apply(icosphere(2))


@pytest.mark.parametrize(
    ("parameters", "about", "why"),
    [
        (lambda p: {k: v for k, v in p.items() if k != "weights/1"}, {}, "another shape"),
        (lambda p: {**p, "table": p["table"] * np.nan}, {}, "not finite"),
        (dict, {"half": 0.0}, "a box without a size"),
        (dict, {"light": [0.0, math.inf, 0.0]}, "a box without a size"),
        (dict, {"light": [0.0]}, "a box without a size"),
        (dict, {"occupancy": 12}, "another grid"),
    ],
)
def test_damaged_files_are_refused(run_folder, tmp_path, parameters, about, why):
    texture = NerfTexTexture.load(run_folder)
    damaged = NerfTexTexture(
        parameters(dict(texture.parameters)), texture.occupied, {**texture.about, **about}
    )
    with pytest.raises(CheckpointError, match=why):
        NerfTexTexture.load(damaged.save(tmp_path / "damaged.safetensors"))


def first_loss(box, config: NerfTexConfig) -> float:
    pictures, lights = picture_box(box, config.views, config.view, config.seed)
    task = BoxTask(config, pictures, lights, possible_cells(box, config.occupancy))
    return task.loss(0, torch.Generator().manual_seed(0)).value.item()


@pytest.mark.parametrize("change", ["network=frequencies", "views=20", "view=12", "table=9", "seed=1"])
def test_every_setting_changes_the_first_step(box, change):
    settings = [resolve(PRESETS, overrides=s) for s in (SMALL, [*SMALL, change])]
    assert first_loss(box, settings[0]) != first_loss(box, settings[1])


def test_a_table_means_nothing_to_a_network_without_one(tmp_path):
    """Which is said before the texture is read."""
    with pytest.raises(ConfigError, match="table means nothing without a hash grid; leave it out"):
        fit(tmp_path / "none", set=["table=9", "network=frequencies"])


def test_patches_are_multiples_of_8():
    with pytest.raises(ConfigError, match="patch = 100 is no multiple of 8"):
        NerfTexConfig(patch=100)


def test_on_a_plane_light_keeps_its_direction(run_folder):
    """Boxes look the same when window, plane and light are turned together."""
    renderer = NerfTexTexture.load(run_folder).on_plane(np.array([1.0, 0, 0]))
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    renderer.turn_light(turn)
    assert renderer.field.field._light == pytest.approx(turn @ renderer.light, abs=1e-6)


@pytest.mark.parametrize(
    ("option", "value", "out"),
    [
        ("--scale", "0.01", "a.png"),
        ("--spacing", "3", "a.png"),
        ("--tilt", "60", "a.png"),
        ("--lift", "2", "a.png"),
        ("--density", "0", "a.png"),
        ("--seed", "-1", "a.png"),
        ("--resolution", "10", "a.png"),
        ("--resolution", "64", "a.glb"),
    ],
)
def test_the_command_refuses_them_too(run_folder, tmp_path, monkeypatch, capsys, option, value, out):
    monkeypatch.chdir(tmp_path)
    assert main(["apply", str(run_folder), "--mesh", "vase", "--out", out, f"{option}={value}"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert option in line
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "setting", [{"patch": 0}, {"views": 8}, {"view": 4}, {"network": "grid"}, {"table": 3}]
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(ConfigError, match=next(iter(setting))):
        NerfTexConfig(**setting)
