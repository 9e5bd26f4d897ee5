"""Textures that follow a vector field: their up points along it, in what grows and in what is shown."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.geometry.vectors import rotate_about
from mitex.mesh import grid, icosphere
from mitex.mesh.fields import vector_field
from mitex.methods.nca.orientation import cell_turns
from tests.methods.nca import tiny

SPHERE = icosphere(5)
AWAY = np.abs(SPHERE.vertices[:, 1]) < 0.9  # from the poles, where up is anywhere
OPTIONS = {"steps": 8, "subdivide": 1, "resolution": None}


@pytest.fixture(scope="module")
def texture():
    return tiny.texture(("albedo", "normal"), shape=None)


def turned(angle):
    """The field `up`, turned about the normals [rad]."""
    up = vector_field(SPHERE, "up").astype(np.float64)
    return rotate_about(up, SPHERE.normals.astype(np.float64), angle).astype(np.float32)


@pytest.mark.parametrize("angle", [0.0, 1.0, -2.5])
def test_a_field_turned_from_up_is_that_angle(angle):
    turns = cell_turns(turned(angle), SPHERE, SPHERE)
    assert np.allclose(np.asarray(turns)[AWAY], angle, atol=1e-4)
    assert cell_turns(90.0, SPHERE, SPHERE) == pytest.approx(np.pi / 2)


def test_a_field_is_as_good_as_its_angle(texture):
    """On a flat mesh all of them, with the tangents of the asset and on a mesh that is subdivided."""
    mesh = grid(6, 6)
    one = texture.apply(mesh, orientation="1,1,0", **OPTIONS)
    other = texture.apply(mesh, orientation=-45.0, **OPTIONS)
    plain = texture.apply(mesh, **OPTIONS)
    assert one.tangents is not None and np.allclose(one.tangents, other.tangents, atol=1e-5)
    for name, values in one.vertex_maps.items():
        assert np.abs(values - other.vertex_maps[name]).max() < 1e-3 < np.ptp(values)
    assert np.abs(one.vertex_maps["albedo"] - plain.vertex_maps["albedo"]).max() > 1e-3


def test_tangents_are_across_the_normals_and_the_field(texture):
    field = turned(0.7)
    asset = texture.apply(SPHERE, orientation=field, **OPTIONS)
    assert asset.tangents is not None
    assert np.abs((asset.tangents * SPHERE.normals).sum(axis=1)).max() < 1e-5
    assert np.abs((asset.tangents * field).sum(axis=1)[AWAY]).max() < 0.12


def test_a_field_that_is_none_is_refused(texture):
    with pytest.raises(ConfigError, match="there is no vector field 'sideways'"):
        texture.apply(SPHERE, orientation="sideways", **OPTIONS)
