"""Camera batches: formulae, distributions, rays against Mitsuba's own sensors."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import Mesh, icosphere
from mitex.scenes import orbit, patch_views, random_views, turntable
from tests.scenes.helpers import front_camera
from tests.scenes.reference import trace


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_random_views_follow_the_paper():
    views = random_views(generator(), 4000, distance=2.5)
    assert views.kind == "perspective"
    assert views.shape == (4000, 320, 320)
    assert views.fov == 60
    np.testing.assert_allclose(np.linalg.norm(views.origin, axis=1), 2.5, rtol=1e-6)
    np.testing.assert_array_equal(views.target, 0)
    np.testing.assert_array_equal(views.up, np.broadcast_to((0, 1, 0), (4000, 3)))
    # Elevation is the arcsine of a uniform number: the height over the distance is uniform in [-1, 1].
    sine = np.sort(views.origin[:, 1] / 2.5)
    azimuth = np.sort(np.arctan2(views.origin[:, 2], views.origin[:, 0]) % (2 * math.pi))
    grid = (np.arange(4000) + 0.5) / 4000
    assert np.abs(sine - (2 * grid - 1)).max() < 2 * 0.03  # Kolmogorov-Smirnov, p < 0.002
    assert np.abs(azimuth / (2 * math.pi) - grid).max() < 0.03


def test_random_views_depend_on_the_generator_alone():
    torch.manual_seed(0)
    first = random_views(generator(5), 3)
    torch.manual_seed(1)
    second = random_views(generator(5), 3)
    np.testing.assert_array_equal(first.origin, second.origin)
    assert not np.array_equal(first.origin, random_views(generator(6), 3).origin)


def test_central_ray_looks_at_the_target():
    for views in (random_views(generator(), 5, resolution=3), orbit(4, resolution=3)):
        origins, directions = views.rays()
        to_target = views.target - views.origin
        to_target /= np.linalg.norm(to_target, axis=1, keepdims=True)
        np.testing.assert_allclose(directions[:, 1, 1], to_target, atol=1e-6)
        np.testing.assert_array_equal(origins[:, 0, 2], views.origin)


def test_fov_is_vertical_and_rows_run_down():
    cameras = front_camera("perspective", 2.0, fov=60, width=5, height=201)
    direction = cameras.rays()[1][0]
    top, right = direction[0, 2], direction[100, 4]
    slope = math.tan(math.radians(30)) / 201
    assert top[1] / -top[2] == pytest.approx(slope * 200, abs=1e-6)
    assert right[0] / -right[2] == pytest.approx(slope * 4, abs=1e-6)  # square pixels


def test_orthographic_extent():
    cameras = front_camera("orthographic", 2.0, half_width=0.5, width=8, height=4)
    origins, directions = cameras.rays()
    np.testing.assert_allclose(directions, np.broadcast_to((0, 0, -1), directions.shape), atol=1e-7)
    np.testing.assert_allclose(origins[0, 0, 0], (-0.875, 0.375, 2), atol=1e-6)
    np.testing.assert_allclose(origins[0, 3, 7], (0.875, -0.375, 2), atol=1e-6)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_rays_agree_with_mitsuba_sensors(mi, kind: str):
    views = replace(random_views(generator(3), 2), kind=kind, half_width=0.8, width=6, height=9)
    origins, directions = views.rays()
    row, column = (index.ravel() for index in np.mgrid[:9, :6])
    for k, sensor in enumerate(views.sensors()):
        position = mi.Point2f((column + 0.5) / 6, (row + 0.5) / 9)
        ray, _ = mi.load_dict(sensor).sample_ray(0.0, 0.5, position, mi.Point2f(0.5))
        o, d = (np.broadcast_to(np.array(x).T, (54, 3)) for x in (ray.o, ray.d))
        np.testing.assert_allclose(d, directions[k].reshape(-1, 3), atol=2e-6)
        # Mitsuba starts at the near plane: compare the lines.
        np.testing.assert_allclose(np.cross(o - origins[k].reshape(-1, 3), d), 0, atol=2e-6)


def test_turntable_is_one_even_turn():
    views = turntable(8, elevation=30, resolution=(30, 20))
    assert views.shape == (8, 20, 30)
    np.testing.assert_allclose(views.origin[0] / 2.5, (0, 0.5, math.sqrt(0.75)), atol=1e-6)
    steps = np.linalg.norm(views.origin - np.roll(views.origin, 1, axis=0), axis=1)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-5)


def test_orbit_over_the_pole_has_an_up():
    views = orbit(2, elevation=90)
    assert np.isfinite(views.rays()[1]).all()


def test_patch_views_show_only_surface_on_a_sphere():
    mesh = icosphere(6)
    views = patch_views(generator(1), mesh, 6, half_width=0.65, resolution=7)  # 0.65 sqrt(2) = 0.92
    origins, directions = views.rays()
    assert (trace(mesh, origins.reshape(-1, 3), directions.reshape(-1, 3))[0] >= 0).all()
    beyond = replace(views, half_width=0.9)  # the corner pixels are 1.09 from the axis
    origins, directions = beyond.rays()
    hit = trace(mesh, origins.reshape(-1, 3), directions.reshape(-1, 3))[0].reshape(beyond.shape) >= 0
    assert not hit[:, (0, 0, -1, -1), (0, -1, 0, -1)].any()
    assert hit[:, 3, 3].all()


def test_patch_views_look_along_the_inward_normal_with_y_up():
    mesh = icosphere(8)
    views = patch_views(generator(2), mesh, 200, half_width=0.3, resolution=9)
    right, up, forward = views.axes()
    # On a sphere the normal is the direction from the centre, up to the coarseness of the mesh.
    assert (np.sum(forward * views.target, axis=1) < -0.97).all()
    np.testing.assert_allclose(right[:, 1], 0, atol=1e-6)
    assert (up[:, 1] > 0).all()
    assert (np.linalg.norm(views.origin, axis=1) > 1).all()


def test_patch_views_sample_area_uniformly():
    # Two triangles, one of 3 times the other's area.
    vertices = np.array([(0, 0, 0), (3, 0, 0), (0, 1, 0), (-1, 0, 0)], np.float32)
    mesh = Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)], np.int32))
    target = patch_views(generator(), mesh, 4000, half_width=0.1, resolution=2).target
    large = target[target[:, 0] > 0]
    assert len(large) / 4000 == pytest.approx(0.75, abs=0.03)
    np.testing.assert_allclose(large.mean(axis=0), (1, 1 / 3, 0), atol=0.05)  # the centroid


def test_patch_views_at_the_pole_use_x_up():
    vertices = np.array([(0, 0, 0), (0, 0, 1), (1, 0, 0)], np.float32)  # faces +y
    views = patch_views(generator(), Mesh(vertices, np.array([(0, 1, 2)], np.int32)), 2, 0.1, 4)
    np.testing.assert_allclose(views.axes()[2], np.broadcast_to((0, -1, 0), (2, 3)), atol=1e-6)
    np.testing.assert_allclose(views.axes()[1], np.broadcast_to((1, 0, 0), (2, 3)), atol=1e-6)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"kind": "fisheye"}, "kind"),
        ({"fov": 0.0}, "field of view"),
        ({"fov": 180}, "field of view"),
        ({"width": 0}, "image size"),
        ({"origin": (0, 0, np.nan)}, "not finite"),
        ({"origin": (0, 0)}, "shapes"),
        ({"target": np.zeros((2, 3))}, "shapes"),
        ({"up": (0, 0, 1)}, "parallel"),
        ({"target": (0, 0, 2)}, "parallel"),
        ({"kind": "orthographic", "half_width": 0.0}, "half_width"),
        ({"kind": "orthographic", "half_width": math.nan}, "half_width"),
    ],
)
def test_impossible_cameras_are_refused(change: dict, problem: str):
    possible = front_camera("perspective", 2.0)
    with pytest.raises(ConfigError, match=problem):
        replace(possible, **change)
