"""Patches show the colours of the asset and nothing else, the same for all assets of a mesh."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.evaluation.patches import albedo_views, patch_cameras
from mitex.export.common import asset_from_textures
from mitex.geometry.vectors import unit
from mitex.images import bilinear
from mitex.mesh import icosphere
from mitex.methods.layout import with_layout

SIDE = 24


@pytest.fixture(scope="module")
def sphere():
    return icosphere(16)


@pytest.fixture(scope="module")
def cameras(sphere):
    return patch_cameras(sphere, 3, 0.5, SIDE)


def positions(mesh):
    return (0.5 + 0.4 * mesh.vertices).astype(np.float32)


def test_pixels_show_the_point_that_they_see(sphere, cameras):
    """A colour that tells its place: the middle of a patch is where the camera looks."""
    images, mask = albedo_views(Asset(sphere, {"albedo": positions(sphere)}), cameras)
    middle = images[:, SIDE // 2 - 1 : SIDE // 2 + 1, SIDE // 2 - 1 : SIDE // 2 + 1].mean((1, 2))
    assert mask.all()
    assert (middle - 0.5) / 0.4 == pytest.approx(cameras.target, abs=0.01)


def test_textures_and_vertices_of_the_same_colours_look_the_same(sphere, cameras):
    asset = Asset(sphere, {"albedo": positions(sphere)})
    baked = asset.baked(256)
    turned = replace(baked, vertex_maps={"albedo": 1 - asset.vertex_maps["albedo"]})  # not what is shown
    assert albedo_views(turned, cameras)[0] == pytest.approx(albedo_views(asset, cameras)[0], abs=0.02)


def test_an_asset_without_colours_is_grey(sphere, cameras):
    images, _ = albedo_views(Asset(sphere, {"height": np.zeros((len(sphere.vertices), 1))}), cameras)
    assert images == pytest.approx(np.full(images.shape, 0.7), abs=1e-3)


def test_what_is_seen_flatly_or_not_at_all_does_not_count(sphere):
    """Wider than the sphere: a disc counts whose border is seen at 60 degrees."""
    cameras = patch_cameras(sphere, 1, 3.0, 96)
    asset = Asset(sphere, {"albedo": positions(sphere)})
    (image,), (mask,) = albedo_views(asset, cameras)
    assert mask.mean() == pytest.approx(np.pi * 0.75 / 9, rel=0.03)  # the sine of 60 degrees, squared
    outside = image[~mask]
    assert outside == pytest.approx(np.broadcast_to(outside[0], outside.shape))
    assert image[mask].mean(0) == pytest.approx(outside[0], abs=0.05)


def test_patches_that_face_the_camera_come_first():
    """Of a thin cylinder with wide caps, patches on the side would show little."""
    mesh = icosphere(12).with_vertices(icosphere(12).vertices * np.array([1, 0.05, 1]))
    normals = unit(patch_cameras(mesh, 4, 0.6, SIDE).axes()[2])
    assert (np.abs(normals[:, 1]) > 0.7).all()


def test_cameras_depend_on_the_seed_alone(sphere, cameras):
    assert np.array_equal(patch_cameras(sphere, 3, 0.5, SIDE).target, cameras.target)
    assert not np.array_equal(patch_cameras(sphere, 3, 0.5, SIDE, seed=1).target, cameras.target)


def test_lookup_meets_texel_centres_and_is_linear_between():
    image = np.random.default_rng(0).random((8, 8, 2))
    centres = (np.array([[2, 1], [3, 1], [7, 7], [0, 0]]) + 0.5) / 8  # columns and rows
    uv = np.stack([centres[:, 0], 1 - centres[:, 1]], 1)
    assert bilinear(image, uv) == pytest.approx(image[[1, 1, 7, 0], [2, 3, 7, 0]])
    assert bilinear(image, uv[:2].mean(0, keepdims=True))[0] == pytest.approx(image[1, 2:4].mean(0))
    assert bilinear(image, np.array([[0.0, 1.0]]))[0] == pytest.approx(image[0, 0])


def test_a_texture_is_laid_as_its_uvs_say(sphere, cameras):
    mesh = with_layout(sphere, 128)
    assert mesh.uv is not None
    black = asset_from_textures(mesh, mesh.uv, {"albedo": np.zeros((128, 128, 3), np.float32)}, "ball")
    assert albedo_views(black, cameras)[0].max() == 0
