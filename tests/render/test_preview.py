"""Previews show the points of the surface that the camera sees, lit from the upper left."""

import numpy as np
import pytest

from mitex.asset import clay
from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.mesh import icosphere
from mitex.render import still, tone
from mitex.render.preview import PreviewRenderer

SPHERE = icosphere(12)


def preview(azimuth=0.0, elevation=0.0, mesh=SPHERE, resolution=32):
    return PreviewRenderer(mesh, resolution=resolution, azimuth=azimuth, elevation=elevation)


def points(renderer, mesh=SPHERE):
    return interpolate(renderer.barycentric, mesh.vertices[mesh.faces[renderer.face]])


@pytest.mark.parametrize(
    ("azimuth", "elevation", "direction"),
    [
        (0, 0, (0, 0, 1)),
        (90, 0, (1, 0, 0)),
        (0, 60, (0, np.sin(np.pi / 3), 0.5)),
        (180, -30, (0, -0.5, -0.866)),
    ],
)
def test_it_sees_the_side_that_it_is_asked_for(azimuth, elevation, direction):
    mean = points(preview(azimuth, elevation)).mean(axis=0)
    assert mean / np.linalg.norm(mean) @ np.array(direction) > 0.999


def test_colours_stand_where_their_points_are():
    """What is at +x from +z is on the right, what is at +y is above; the background is white."""
    renderer = preview()
    places = points(renderer)
    albedo = np.stack([places[:, 0] > 0, places[:, 1] > 0, np.zeros(len(places))], axis=1).astype(np.float32)
    picture = renderer.render(albedo, np.broadcast_to([0.0, 0.0, 1.0], places.shape))
    assert (picture[0, 0] > 0.999).all() and picture.dtype == np.float32
    assert picture[10, 22, 0] > 0.5 > picture[10, 10, 0] and picture[10, 16, 1] > 0.5 > picture[22, 16, 1]


def test_light_comes_from_the_upper_left_and_occlusion_darkens():
    renderer = preview(azimuth=70)
    normals, grey = points(renderer), np.full((len(renderer.face), 3), 0.7, np.float32)
    lit, occluded = renderer.render(grey, normals), renderer.render(grey, normals, 0.2)
    assert lit[9, 9].sum() > lit[23, 23].sum() + 0.3 and (occluded <= lit + 1e-6).all()
    assert occluded[23, 23].sum() < lit[23, 23].sum() - 0.2


def test_it_is_framed_as_path_traced_pictures_are():
    """White paper stands behind neither; silhouettes agree but for soft edges."""
    asset = clay(SPHERE)
    traced = tone(still(asset, resolution=32, spp=4, floating=True))
    renderer = preview(azimuth=25, elevation=18)
    dark = renderer.render(np.zeros((len(renderer.face), 3), np.float32), np.zeros((len(renderer.face), 3)))
    assert ((dark.mean(axis=2) < 0.9) != (traced.mean(axis=2) < 0.95)).mean() < 0.06


@pytest.mark.parametrize(("resolution", "elevation"), [(8, 0), (64, 89)])
def test_bad_pictures_are_refused(resolution, elevation):
    with pytest.raises(ConfigError):
        preview(resolution=resolution, elevation=elevation)
