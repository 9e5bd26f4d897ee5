"""`vector_field`: the fields of the MeshNCA paper, directions, files and arrays; and what it refuses."""

from functools import cache

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.mesh import Mesh, grid, icosphere, scattered_sphere, torus
from mitex.mesh.fields import NAMES, read_vectors, vector_field

BALL = scattered_sphere(200)  # its vertex mean is not the origin
WHEEL = torus(24, 12)

# Table 8 of the MeshNCA paper, as it is printed.
FORMULAS = {
    "right": lambda x, y, z: (1, 0, 0),
    "left": lambda x, y, z: (-1, 0, 0),
    "up": lambda x, y, z: (0, 1, 0),
    "down": lambda x, y, z: (0, -1, 0),
    "shear-up": lambda x, y, z: (0, z + 1, 0),
    "shear-down": lambda x, y, z: (0, -z - 1, 0),
    "about-x": lambda x, y, z: (0, -z / np.sqrt(x * x + y * y + z * z), y / np.sqrt(x * x + y * y + z * z)),
    "about-y": lambda x, y, z: (z / np.sqrt(x * x + y * y + z * z), 0, -x / np.sqrt(x * x + y * y + z * z)),
}


@cache
def vertex_normals(mesh: Mesh) -> np.ndarray:
    total = np.zeros((len(mesh.vertices), 3))
    for face in mesh.faces:
        p, q, r = mesh.vertices[face].astype(np.float64)
        total[face] += np.cross(q - p, r - p)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def tangent(mesh: Mesh, vectors: list) -> np.ndarray:
    """Equations 10 and 18, one vertex after the other."""
    parts = [u - (u @ n) * n for u, n in zip(np.array(vectors), vertex_normals(mesh), strict=True)]
    return np.array(parts) / np.mean([np.linalg.norm(part) for part in parts])


@pytest.mark.parametrize("name", FORMULAS)
def test_named_fields_are_those_of_the_paper(name):
    points = BALL.vertices - BALL.vertices.mean(axis=0, dtype=np.float64)
    points /= max(np.linalg.norm(p) for p in points)
    expected = tangent(BALL, [FORMULAS[name](*point) for point in points])
    field = vector_field(BALL, name)
    assert field.dtype == np.float32
    np.testing.assert_allclose(field, expected, atol=2e-6)


def test_every_name_is_tested():
    assert set(FORMULAS) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_named_fields_do_not_depend_on_place_and_size(name):
    moved = WHEEL.with_vertices(3.0 * WHEEL.vertices + np.array([5.0, -2.0, 1.0], np.float32))
    np.testing.assert_allclose(vector_field(moved, name), vector_field(WHEEL, name), atol=1e-5)


@pytest.mark.parametrize("source", [*NAMES, "1,2,-3", np.random.default_rng(0).normal(size=(288, 3))])
def test_fields_are_tangent_and_of_mean_length_1(source):
    field = vector_field(WHEEL, source)
    assert np.abs((field * WHEEL.normals).sum(axis=1)).max() < 1e-6
    assert np.linalg.norm(field, axis=1).mean() == pytest.approx(1.0, abs=1e-6)


def test_direction():
    np.testing.assert_array_equal(vector_field(WHEEL, "-2, 0,0"), vector_field(WHEEL, "left"))


def test_files_and_arrays_agree(tmp_path):
    values = np.random.default_rng(1).normal(size=(len(BALL.vertices), 3)).astype(np.float32)
    np.save(tmp_path / "field.npy", values)
    expected = vector_field(BALL, values)
    np.testing.assert_array_equal(vector_field(BALL, tmp_path / "field.npy"), expected)
    for names in ("vx vy vz", "fx fy fz", "u v w"):
        lines = [f"property float {name}" for name in ["x", "y", "z", *names.split()]]
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(values)}", *lines]
        rows = np.concatenate([BALL.vertices, values], axis=1).tobytes()
        (tmp_path / "field.ply").write_bytes("\n".join([*header, "end_header\n"]).encode() + rows)
        np.testing.assert_array_equal(vector_field(BALL, str(tmp_path / "field.ply")), expected)


def test_long_and_short_vectors():
    values = np.random.default_rng(2).normal(size=(len(BALL.vertices), 3))
    expected = vector_field(BALL, values)
    for factor in (1e-300, 1e300):
        np.testing.assert_allclose(vector_field(BALL, factor * values), expected, atol=1e-6)


def test_a_vertex_may_rest():
    values = np.tile([1.0, 0.0, 0.0], (len(BALL.vertices), 1))
    values[7] = 0.0
    assert not vector_field(BALL, values)[7].any()
    assert not vector_field(icosphere(2), "up")[[0, 11]].any()  # the poles, where up is the normal


def refusal(source, mesh=BALL) -> str:
    with pytest.raises(ConfigError) as caught:
        vector_field(mesh, source)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_refuses_fields_that_are_none():
    values = np.ones((len(BALL.vertices), 3))
    values[3, 1] = np.nan
    assert "NaN or infinite at 1 of 200 vertices (first: 3)" in refusal(values)
    values[3, 1] = np.inf
    assert "NaN or infinite" in refusal(values)
    assert "zero everywhere" in refusal(0 * BALL.vertices)
    assert "zero everywhere" in refusal("0,0,0")
    assert "give numbers of shape (200, 3)" in refusal(np.ones((199, 3)))
    assert "float64 (200, 2)" in refusal(np.ones((200, 2)))
    assert "complex128" in refusal(np.ones((200, 3), complex))
    assert "normal to the surface of 'sphere200' everywhere" in refusal(BALL.normals)
    assert "normal to the surface of 'grid' everywhere" in refusal("0,0,1", grid(3, 3))


def test_refuses_names_that_are_none():
    assert "there is no vector field 'about_y'; did you mean about-y?" in refusal("about_y")
    everything = refusal("sideways")
    assert all(name in everything for name in (*NAMES, "1,0,0", ".npy, .ply, .json"))
    assert "is no direction" in refusal("1,0")
    assert "is no direction" in refusal("1,0,a")
    assert "NaN" in refusal("1,0,nan")


def test_refuses_files_that_are_none(tmp_path):
    assert "there is no file of vectors at" in refusal(tmp_path / "a.npy")
    assert "there is no file of vectors at" in refusal(str(tmp_path / "a\0.ply"))
    for suffix, remedy in ((".npy", "numpy.save"), (".ply", "not a PLY file")):
        (tmp_path / f"b{suffix}").write_bytes(b"0" * 100)
        assert remedy in refusal(tmp_path / f"b{suffix}")
    np.save(tmp_path / "c.npy", np.array([{}]), allow_pickle=True)
    assert "not a NumPy array" in refusal(tmp_path / "c.npy")
    np.save(tmp_path / "c.npy", BALL.vertices)
    (tmp_path / "c.npy").write_bytes((tmp_path / "c.npy").read_bytes()[:-100])
    assert "not a NumPy array" in refusal(tmp_path / "c.npy")
    np.save(tmp_path / "c.npy", BALL.vertices.astype(str))
    assert "give numbers of shape" in refusal(tmp_path / "c.npy")
    with (tmp_path / "c.npy").open("wb") as file:
        np.savez(file, BALL.vertices)
    assert "not a NumPy array" in refusal(tmp_path / "c.npy")
    bare = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"
    (tmp_path / "d.ply").write_text(bare)
    assert "give them properties vx vy vz, fx fy fz, u v w" in refusal(tmp_path / "d.ply")


def test_vectors_of_a_file_are_those_written(tmp_path):
    np.save(tmp_path / "field.npy", 3 * BALL.vertices)
    np.testing.assert_array_equal(read_vectors(BALL, tmp_path / "field.npy"), 3 * BALL.vertices)
    with pytest.raises(ConfigError, match="is no file of vectors; give one that ends in .npy, .ply, .json"):
        read_vectors(BALL, tmp_path / "field.txt")
