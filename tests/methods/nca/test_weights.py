"""Weights over a mesh, from each of their sources, against direct computation."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from mitex.errors import ConfigError
from mitex.mesh import grid, icosphere, subdivide_midpoint
from mitex.methods.nca.region import region
from mitex.methods.nca.weights import graft_weights

MESH = grid(3, 4)
FINE = subdivide_midpoint(MESH, 2).vertices.astype(np.float64)


def smoothstep(x):
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


@pytest.mark.parametrize("value", [0, 1, 0.25])
def test_one_weight_everywhere(value):
    assert (graft_weights(MESH, value)(FINE) == np.float32(value)).all()


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("x", lambda p: (p[:, 0] - p[:, 0].min()) / np.ptp(p[:, 0])),
        ("y", lambda p: (p[:, 1] - p[:, 1].min()) / np.ptp(p[:, 1])),
        ("z:-0.5:0.5", lambda p: np.clip(p[:, 2] + 0.5, 0, 1)),
        ("y:0.4:-.1", lambda p: np.clip((0.4 - p[:, 1]) / 0.5, 0, 1)),
        ("0.6,-2e-1,0,1.6", lambda p: smoothstep(2 - np.linalg.norm(p - [0.6, -0.2, 0], axis=1) / 0.8)),
    ],
)
def test_gradients_and_places_around_a_point(source, expected):
    sphere = icosphere(4)
    points = sphere.vertices.astype(np.float64)
    weights = graft_weights(sphere, source)(points)
    assert weights.dtype == np.float32 and np.allclose(weights, expected(points), atol=1e-6)
    assert np.ptp(weights) > 0.3


@pytest.mark.parametrize("kind", ["array", "npy", "ply", "red"])
def test_vertex_maps_are_interpolated(tmp_path, kind):
    """What is linear over the mesh is so between its vertices."""
    values = 0.2 + 0.3 * MESH.vertices[:, 0] + 0.1 * MESH.vertices[:, 1]
    values = (values - values.min()) / np.ptp(values)
    if kind == "red":
        values = np.round(values * 255) / 255
    source = {"array": lambda: values, "npy": npy, "ply": ply, "red": ply}[kind]
    source = values if kind == "array" else source(tmp_path, values, kind)
    weights = graft_weights(MESH, source)
    assert np.allclose(weights(MESH.vertices.astype(np.float64)), values, atol=1e-6)
    middle = (MESH.vertices[MESH.faces].mean(axis=1)).astype(np.float64)
    assert np.allclose(weights(middle), values[MESH.faces].mean(axis=1), atol=1e-6)


def npy(folder, values, _):
    np.save(folder / "w.npy", values)
    return folder / "w.npy"


def ply(folder, values, kind):
    kind, numbers = ("float", values) if kind == "ply" else ("uchar", np.round(values * 255).astype(int))
    name = "quality" if kind == "float" else "red"
    head = f"ply\nformat ascii 1.0\nelement vertex {len(values)}\nproperty {kind} {name}\nend_header\n"
    (folder / "w.ply").write_text(head + "".join(f"{number}\n" for number in numbers))
    return folder / "w.ply"


def test_a_painted_picture_is_read_at_the_uvs(tmp_path):
    """Its top is v = 1; only red counts, and white is exactly 1."""
    uv = MESH.vertices[MESH.faces][..., :2]
    low, high = uv.min(axis=(0, 1)), uv.max(axis=(0, 1))
    mesh = replace(MESH, uv=(uv - low) / (high - low))
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:32, :, 0], pixels[:, 32:, 1] = 255, 255
    Image.fromarray(pixels).save(tmp_path / "paint.png")
    v = (FINE[:, 1] - low[1]) / (high[1] - low[1])
    weights = graft_weights(mesh, tmp_path / "paint.png")(FINE)
    assert (weights[v > 0.51] == 1).all() and (weights[v < 0.49] == 0).all()


def test_points_of_long_faces_are_found():
    """The nearest centres are those of the small faces beside them."""
    mesh = subdivide_midpoint(grid(1, 1), 4)
    big = mesh.vertices[:, :2].max() + np.array([[0, -9, 0], [0, 9, 0], [30, 0, 0]], np.float32)
    count = len(mesh.vertices)
    both = replace(
        mesh,
        vertices=np.concatenate([mesh.vertices, big]),
        faces=np.concatenate([mesh.faces, [[count, count + 1, count + 2]]]),
        uv=None,
    )
    values = np.zeros(count + 3)
    values[count:] = 1
    inside = big.astype(np.float64).mean(axis=0) * 0.02 + big[:2].astype(np.float64).mean(axis=0) * 0.98
    assert graft_weights(both, values)(inside[None])[0] == 1


BAD = {
    "another word": ("w", "says nothing about weights"),
    "a large number": ("1.5", "not from 0 to 1"),
    "the same place twice": ("x:1:1", "give two different places"),
    "no radius": ("0,0,0,0", "give a radius above 0"),
    "no file": ("w.npy", "there is no file of weights"),
    "text": ("text.npy", "not a NumPy array"),
    "objects": ("objects.npy", "not a NumPy array"),
    "too short": (np.zeros(3), "give one number for each of"),
    "NaN": (np.full(len(MESH.vertices), np.nan), "not from 0 to 1"),
    "negative": (np.full(len(MESH.vertices), -1.0), "not from 0 to 1"),
    "no such property": ("bare.ply", "give them properties weight, quality, red"),
    "no UVs": ("paint.png", "has no UVs"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_sources_are_refused(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.npy").write_text("0 1 2")
    np.save(tmp_path / "objects.npy", np.array([{}], object), allow_pickle=True)
    (tmp_path / "bare.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"
    )
    Image.new("RGB", (16, 16)).save(tmp_path / "paint.png")
    source, message = BAD[name]
    with pytest.raises(ConfigError, match=message):
        graft_weights(replace(MESH, uv=None), source)


@pytest.mark.parametrize(
    ("text", "inside"),
    [
        ("0,0,0,0.5", lambda p: np.linalg.norm(p, axis=1) <= 0.5),
        ("x:-0.2:0.4", lambda p: (p[:, 0] >= -0.2) & (p[:, 0] <= 0.4)),
        ("y:0:", lambda p: p[:, 1] >= 0),
        ("z::-.3", lambda p: p[:, 2] <= -0.3),
    ],
)
def test_regions(text, inside):
    points = np.random.default_rng(0).uniform(-1, 1, (200, 3))
    assert np.array_equal(region(text)(points), inside(points)) and inside(points).any()


@pytest.mark.parametrize("text", ["", "0,0,0", "0,0,0,-1", "w:0:1", "x", "x:a:b"])
def test_what_is_no_region_is_refused(text):
    with pytest.raises(ConfigError, match="is no region"):
        region(text)
