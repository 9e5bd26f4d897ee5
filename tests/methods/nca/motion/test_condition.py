"""What cells are told of a field, through the texture's own methods."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError, TextureWarning
from mitex.mesh import Lattice, grid, icosphere, subdivide_midpoint
from mitex.mesh.fields import vector_field
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.motion.cell_motion import STILL
from mitex.methods.nca.motion.condition import flat_vectors
from tests.methods.nca import tiny


@pytest.fixture(scope="module")
def moving():
    """Its condition matters: the weights are random."""
    texture = tiny.texture(condition=3, shape=None)
    return NcaTexture(texture.look, {"name": "flow", "motion": "right"})


@pytest.fixture(scope="module")
def still():
    return tiny.texture(shape=None)


@pytest.fixture(scope="module")
def sphere():
    return icosphere(4)


def _condition(texture, mesh, levels=0, **options):
    return texture.motion(Cells.of(mesh, levels), **options).condition.numpy()


def test_the_condition_is_the_field_times_the_speed(moving, still, sphere):
    fine = subdivide_midpoint(sphere, 1)
    for field in ("up", "0,0,1", "about-x"):
        expected = 1.5 * vector_field(fine, field)
        assert np.allclose(_condition(moving, sphere, 1, field=field, speed=1.5), expected, atol=1e-6)
    assert np.allclose(_condition(moving, sphere), vector_field(sphere, "right"), atol=1e-6)
    assert still.motion(Cells.of(sphere, 0)) is STILL


def test_vectors_of_the_given_mesh_are_carried_to_the_cells(moving, sphere, tmp_path):
    vectors = np.cross([0.3, 1, 0], sphere.vertices).astype(np.float32)
    np.save(tmp_path / "field.npy", vectors)
    fine = subdivide_midpoint(sphere, 2)
    expected = vector_field(fine, np.cross([0.3, 1, 0], fine.vertices))
    for source in (vectors, str(tmp_path / "field.npy")):
        assert np.allclose(_condition(moving, sphere, 2, field=source), expected, atol=0.03)
        assert np.allclose(_condition(moving, sphere, 0, field=source), vector_field(sphere, vectors))


def test_an_oriented_texture_follows_the_same_field(moving):
    """The grid turned by -90 degrees grows what a texture turned by 90 degrees does, field and all."""
    mesh = grid(6, 6)
    turned = mesh.with_vertices(mesh.vertices @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], np.float32))
    oriented = moving.grow(mesh, steps=8, orientation=90, field="right")  # of the mesh: x becomes -y
    assert torch.allclose(oriented, moving.grow(turned, steps=8, field="down"), atol=1e-4)
    assert (oriented - moving.grow(turned, steps=8, field="right")).abs().max() > 1e-2


@pytest.mark.parametrize("option", [{"field": "up"}, {"speed": 2.0}])
def test_field_and_speed_count(moving, sphere, option):
    plain = {"steps": 8, "subdivide": 0, "resolution": None}
    one, other = (moving.apply(sphere, **plain, **more).vertex_maps["albedo"] for more in ({}, option))
    assert np.abs(one - other).max() > 0.01
    assert (moving.grow(sphere, steps=8) - moving.grow(sphere, steps=8, **option)).abs().max() > 0.01
    tiles = [moving.tile(32, cells=16, steps=8, **more)["albedo"] for more in ({}, option)]
    assert np.abs(tiles[0] - tiles[1]).max() > 0.01


def test_a_tile_moves_to_the_right_by_default(moving):
    """Whatever it was trained with; and in any direction of the plane."""
    about = NcaTexture(moving.look, {"name": "flow", "motion": "about-y"})
    options: dict[str, Any] = {"cells": 16, "steps": 6}
    default = about.tile(32, **options)["albedo"]
    assert np.array_equal(default, moving.tile(32, field="right", **options)["albedo"])
    diagonal = moving.tile(32, field="1,1,0", **options)["albedo"]
    turned = moving.tile(32, field=f"{math.sqrt(0.5)},{math.sqrt(0.5)},0", **options)["albedo"]
    assert np.allclose(diagonal, turned, atol=1e-5) and np.abs(diagonal - default).max() > 0.01


@pytest.mark.parametrize("use", ["apply", "grow", "tile", "fields"])
def test_a_texture_that_stands_still_says_so(still, sphere, use):
    arguments = () if use == "tile" else (sphere,)
    with pytest.raises(ConfigError, match="'tiny' stands still, so that a speed means nothing; give `field`"):
        getattr(still, use)(*arguments, steps=200_000_000, speed=0.5)


def test_a_texture_whose_cells_know_no_field(still, sphere):
    """The paper's ablation moves, but cannot be told where."""
    fixed = NcaTexture(still.look, {"name": "fixed", "motion": "up"})
    assert fixed.grow(sphere, steps=2).any()
    with pytest.raises(ConfigError, match="'fixed' moves in its own way alone"):
        fixed.grow(sphere, steps=2, field="down")


@pytest.mark.parametrize(
    ("option", "problem"),
    [
        ({"field": "rihgt"}, "did you mean right"),
        ({"field": np.full((162, 3), np.nan)}, "NaN or infinite at 162 of 162"),
        ({"field": np.ones((161, 3))}, r"shape \(162, 3\)"),
        ({"field": np.zeros((162, 3))}, "zero everywhere"),
        ({"speed": -1.0}, "speed of -1; use 0 to 10"),
        ({"speed": math.nan}, "speed of nan"),
    ],
)
def test_fields_and_speeds_that_cannot_be_used(moving, sphere, option, problem):
    """Before any work: so many steps would not end."""
    for use in (moving.apply, moving.grow, moving.fields):
        with pytest.raises(ConfigError, match=problem):
            use(sphere, steps=200_000_000, **option)


def test_a_field_normal_to_the_surface(moving):
    with pytest.raises(ConfigError, match="normal to the surface"):
        moving.grow(grid(4, 4), steps=1, field="0,0,1")


def test_a_tile_needs_one_direction(moving):
    lattice = Lattice.of(16)
    with pytest.raises(ConfigError, match="not the same everywhere"):
        flat_vectors(lattice, lattice.mesh.vertices, 1.0)
    with pytest.raises(ConfigError, match="normal"):
        moving.tile(32, field="0,0,1")
    for source in ("wind.npy", Path("wind.PLY"), "strokes.json"):
        with pytest.raises(
            ConfigError, match="of a mesh; a tile takes one direction, such as right or 1,1,0"
        ):
            moving.tile(32, field=source)


def test_a_moving_texture_without_a_field_says_what_it_needs(moving, sphere):
    nameless = NcaTexture(moving.look, {"name": "flow"})
    with pytest.raises(ConfigError, match="'flow' needs a condition of 3 values .*; give `field`"):
        nameless.grow(sphere, steps=200_000_000)
    assert nameless.grow(sphere, steps=1, field="up").any()


def test_files_keep_condition_and_field(moving, sphere, tmp_path):
    again = NcaTexture.load(moving.save(tmp_path / "flow.safetensors"))
    assert (again.look.rule.condition, again.about["motion"]) == (3, "right")
    assert torch.equal(again.grow(sphere, steps=5), moving.grow(sphere, steps=5, field="right"))


@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_no_vector_is_longer_than_those_of_the_training(moving, sphere, speed):
    """Where it is, it keeps its direction; if many are, the texture says so."""
    slow = NcaTexture(moving.look, moving.about | {"motion_speed": 1.268})
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        vectors = _condition(slow, sphere, speed=speed)
        flat = slow.tile(32, cells=16, steps=6, speed=speed)["albedo"]
    full = speed * vector_field(sphere, "right").astype(np.float64)
    lengths, longest = (np.linalg.norm(v, axis=1) for v in (vectors, full))
    assert np.allclose(lengths, np.minimum(longest, 1.268), atol=1e-5) and longest.max() > 1.27
    assert np.allclose(lengths[:, None] * full, longest[:, None] * vectors, atol=1e-4)
    assert [issubclass(w.category, TextureWarning) for w in caught] == ([] if speed == 1 else [True, True])
    expected = slow.tile(32, cells=16, steps=6, speed=min(speed, 1.268))["albedo"]
    assert np.allclose(flat, expected, atol=1e-5)
