"""A learned box on meshes: options, files, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mitex.cli import main
from mitex.errors import CheckpointError, ConfigError
from mitex.mesh import icosphere
from mitex.methods.baselines.nerf_tex import NerfTexTexture, fit
from mitex.methods.nerf.use.placement import EXTENT
from tests.methods.baselines.nerf_tex.small import SMALL, captured


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
