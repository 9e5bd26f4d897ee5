"""Close-ups of a surface with an exemplar's relief are the exemplar's own maps."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.geometry.vectors import orthonormal
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.relief.pictures import CloseUps, Pictures, in_frame
from mitex.methods.relief.shape import Shape
from mitex.scenes.cameras import Cameras
from tests.methods.relief.waves import AMPLITUDE, elevation, waves

DEPTH = 3 * AMPLITUDE
ALL = ("height", "normal", "albedo")


def turned(mesh: Mesh, turn: np.ndarray) -> Mesh:
    return mesh.with_vertices(mesh.vertices @ turn.T.astype(np.float32))


def close_ups(turn: np.ndarray, joint: bool = True) -> tuple[CloseUps, torch.Tensor]:
    """Of a plane of 2 x 2 widths with the relief of `waves`, and the offsets that make it."""
    plane = turned(grid(160, 160), turn)
    shape = Shape(plane, 0.0, 1.0)
    u, v = 0.5 * (grid(160, 160).vertices[:, :2] + 1).T * 2
    heights = elevation(u, v)
    colours = waves(*ALL).maps["albedo"]
    row, column = ((1 - v % 1) * 64).astype(int) % 64, (u % 1 * 64).astype(int) % 64
    directions = np.tile(turn[:, 0], (4, 1))
    pictures = Pictures(waves(*ALL), joint)
    views = CloseUps(turned(grid(1, 1), turn), directions, shape, colours[row, column], pictures, DEPTH)
    # Mean of the map, from which offsets are counted.
    low = elevation(np.array(0.875), np.array(0.5))
    mean = waves("height").maps["height"].mean() * DEPTH + low
    return views, shape.offsets(shape.coordinates(heights - mean))


def looking(turn: np.ndarray, half_width: float = 0.5, pixels: int = 64) -> Cameras:
    """At the middle of the plane, where the exemplar is seen shifted by half its width."""
    return Cameras(
        "orthographic",
        turn[:, 2:].T * 3,
        np.zeros((1, 3)),
        turn[:, 1:2].T,
        half_width=half_width,
        width=pixels,
        height=pixels,
    )


TURNS = {
    "upright": np.eye(3),
    "oblique": np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0],
}


@pytest.mark.parametrize("name", TURNS)
def test_close_ups_are_the_exemplar(name):
    turn = TURNS[name] * np.sign(np.linalg.det(TURNS[name]))
    views, offsets = close_ups(turn)
    pictures, counts = views(offsets, looking(turn))
    assert counts.all() and pictures.shape == (1, 4, 64, 64, 3)
    expected = torch.roll(Pictures(waves(*ALL), True).exemplar, (32, 32), (1, 2))
    difference = (pictures[0] - expected)[:, 2:-2, 2:-2].abs()
    assert difference[:2].max() < 0.03 and difference[2:].mean() < 0.03
    assert pictures[0, :2].std() > 0.1


def test_joint_pictures_show_what_belongs_together():
    exemplar = waves(*ALL)
    pictures = Pictures(exemplar, True).exemplar
    assert torch.equal(pictures[0], torch.tensor(exemplar.maps["normal"]))
    height = pictures[1, ..., 0]
    for k in (0, 1):
        assert torch.equal(pictures[2 + k, ..., 0], height)
        assert torch.allclose(pictures[2 + k, ..., 1], torch.tensor(exemplar.maps["albedo"]).mean(2))
        assert torch.equal(pictures[2 + k, ..., 2], pictures[0, ..., k])
    assert Pictures(exemplar, False).kinds == 2
    assert Pictures(waves("height", "normal"), True).kinds == 2


def test_the_range_of_heights_fills_the_picture():
    height = Pictures(waves("height", "normal"), False).exemplar[1]
    assert -0.05 < height.min() <= 0 and 1 <= height.max() < 1.05


def test_what_is_far_or_looks_aside_does_not_count():
    """A ball: its rim looks aside. A plate far behind another: seen beside it."""
    ball = icosphere(16)
    pictures = Pictures(waves("height", "normal"), False)
    shape = Shape(ball, 0.0, 1.0)
    right = orthonormal(np.broadcast_to((1.0, 0, 0), ball.vertices.shape), ball.normals)
    views = CloseUps(ball, right, shape, None, pictures, DEPTH)
    none = torch.zeros(len(ball.vertices), 3)
    shown, counts = views(none, looking(np.eye(3), 1.2))
    share = np.pi * (1 - 0.6**2) / 2.4**2  # where the cosine is 0.6, the radius is 0.8
    assert counts.float().mean().item() == pytest.approx(share, abs=0.02)
    assert (shown[0, :, ~counts[0]] == 0.5).all()
    near = looking(np.eye(3), 0.3)  # shows depths of +-0.3 around its middle, which is the ball's, 1 below
    assert not views(none, near)[1].any()


def test_hollows_are_seen():
    """The inside of a ball, from within; a camera outside of it would see nothing that counts."""
    ball = icosphere(12)
    hollow = replace(ball, faces=ball.faces[:, ::-1])
    shape = Shape(hollow, 0.0, 1.0)
    right = orthonormal(np.broadcast_to((1.0, 0.1, 0), ball.vertices.shape), hollow.normals)
    views = CloseUps(hollow, right, shape, None, Pictures(waves("height", "normal"), False), DEPTH)
    cameras = views.cameras(torch.Generator().manual_seed(0), 3, 0.5, 16)
    none = torch.zeros(len(ball.vertices), 3)
    assert views(none, cameras)[1].all()
    outside = replace(cameras, origin=-3 * cameras.axes()[2])
    assert not views(none, outside)[1].any()


def test_frames_turn_with_the_surface():
    generator = torch.Generator().manual_seed(0)
    normals = torch.nn.functional.normalize(torch.randn(5, 3, generator=generator), dim=1)
    x, z = torch.tensor([1.0, 0, 0]).expand(5, 3), torch.tensor([0.0, 0, 1]).expand(5, 3)
    plain = in_frame(normals, z, x)
    assert torch.allclose(plain, 0.5 + 0.5 * normals, atol=1e-6)
    turn = torch.linalg.qr(torch.randn(3, 3, generator=generator))[0]
    turn = turn * torch.det(turn).sign()
    assert torch.allclose(in_frame(normals @ turn.T, z @ turn.T, x @ turn.T), plain, atol=1e-5)


def test_gradients_by_finite_differences(monkeypatch):
    """Of heights and normals, with what each pixel sees held."""
    ball = icosphere(8)
    shape = Shape(ball, 0.0, 1.0)
    right = orthonormal(np.broadcast_to((1.0, 0, 0), ball.vertices.shape), ball.normals)
    views = CloseUps(ball, right, shape, None, Pictures(waves("height", "normal"), False), DEPTH)
    cameras = looking(np.eye(3), 1.2, 24)
    held = views._stage.visibility(cameras)
    monkeypatch.setattr(views._stage, "visibility", lambda cameras: held)
    monkeypatch.setattr(views._stage, "move", lambda vertices: None)
    generator = torch.Generator().manual_seed(1)
    offsets, way = (0.02 * torch.randn(len(ball.vertices), 3, generator=generator) for _ in range(2))
    weights = torch.rand(1, 2, 24, 24, 3, generator=generator)

    def value(x: torch.Tensor) -> torch.Tensor:
        return (weights * views(x, cameras)[0].square()).double().sum()

    offsets.requires_grad_()
    value(offsets).backward()
    assert offsets.grad is not None
    slope = (offsets.grad * way).sum().item()
    with torch.no_grad():
        change = (value(offsets + 0.1 * way) - value(offsets - 0.1 * way)).item() / 0.2
    assert slope == pytest.approx(change, rel=0.02)


def test_cameras_have_the_exemplars_right(monkeypatch):
    turn = TURNS["oblique"] * np.sign(np.linalg.det(TURNS["oblique"]))
    views, _ = close_ups(turn)
    cameras = views.cameras(torch.Generator().manual_seed(0), 3, 0.4, 16)
    assert cameras.shape == (3, 16, 16) and cameras.half_width == 0.2
    np.testing.assert_allclose(cameras.axes()[0], np.tile(turn[:, 0], (3, 1)), atol=1e-5)
    np.testing.assert_allclose(cameras.axes()[1], np.tile(turn[:, 1], (3, 1)), atol=1e-5)
