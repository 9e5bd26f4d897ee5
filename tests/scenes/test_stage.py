"""The stage: visibility against a slow ray tracer, updates, no growth."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError, MeshError
from mitex.mesh import icosphere
from mitex.scenes import patch_views, random_views
from mitex.scenes.cameras import Cameras
from mitex.scenes.stage import Stage, Visibility, background_values
from tests.scenes.helpers import front_camera, live_variables
from tests.scenes.reference import matrix


def bumpy_sphere(rng: np.random.Generator):
    """A sphere with dents: neighbouring depths differ, so wrong weights show."""
    mesh = icosphere(3)
    return mesh.with_vertices(mesh.vertices * rng.uniform(0.6, 1.0, (len(mesh.vertices), 1)))


def dense(visibility: Visibility) -> np.ndarray:
    return visibility.matrix.to_dense().view(*visibility.shape, -1).numpy()


def views(kind: str, width: int = 11, height: int = 9) -> Cameras:
    cameras = random_views(torch.Generator().manual_seed(3), 2)
    return replace(cameras, kind=kind, half_width=1.1, width=width, height=height)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("antialias", [1, 2])
def test_visibility_equals_the_slow_ray_tracer(rng, kind: str, antialias: int):
    mesh, cameras = bumpy_sphere(rng), views(kind)
    visibility = Stage(mesh).visibility(cameras, antialias)
    expected = matrix(mesh, cameras, antialias)
    np.testing.assert_allclose(dense(visibility), expected, atol=1e-5)
    np.testing.assert_allclose(visibility.coverage.numpy(), expected.sum(-1), atol=1e-5)
    assert 0 < visibility.coverage.mean() < 1


def test_antialias_is_the_mean_of_a_finer_image(rng):
    mesh, cameras = bumpy_sphere(rng), views("perspective", 8, 6)
    stage = Stage(mesh)
    fine = dense(stage.visibility(replace(cameras, width=24, height=18)))
    mean = fine.reshape(2, 6, 3, 8, 3, -1).mean(axis=(2, 4))
    np.testing.assert_allclose(dense(stage.visibility(cameras, antialias=3)), mean, atol=1e-6)


def test_views_of_one_wavefront_are_those_of_several(rng):
    stage, cameras = Stage(bumpy_sphere(rng)), views("perspective")
    together = dense(stage.visibility(cameras))
    for k in range(2):
        rows = slice(k, k + 1)
        one = replace(cameras, origin=cameras.origin[rows], target=cameras.target[rows], up=cameras.up[rows])
        np.testing.assert_array_equal(dense(stage.visibility(one))[0], together[k])


def test_per_hit_arrays_describe_the_matrix(rng):
    visibility = Stage(bumpy_sphere(rng)).visibility(views("perspective"), antialias=2)
    assert visibility.vertex_index.dtype == visibility.pixel.dtype == torch.int64
    rebuilt = torch.zeros(visibility.coverage.numel(), visibility.vertices)
    for corner in range(3):
        index = (visibility.pixel, visibility.vertex_index[:, corner])
        rebuilt.index_put_(index, visibility.weight[:, corner], accumulate=True)
    np.testing.assert_allclose(rebuilt.view(*visibility.shape, -1).numpy(), dense(visibility), atol=1e-6)


def test_nothing_in_view():
    away = replace(front_camera("perspective", width=4, height=4), target=np.array([(0, 0, 9)]))
    visibility = Stage(icosphere(2)).visibility(away)
    assert visibility.weight.shape == (0, 3)
    assert not visibility.coverage.any()


def test_patches_are_covered_when_the_square_fits():
    mesh = icosphere(16)
    cameras = patch_views(torch.Generator().manual_seed(0), mesh, 5, half_width=0.7, resolution=48)
    assert (Stage(mesh).visibility(cameras).coverage == 1).all()


def test_move_changes_what_is_seen():
    stage, cameras = Stage(icosphere(4)), views("perspective", 32, 32)
    large = stage.visibility(cameras).coverage.mean()
    stage.move(0.5 * stage.mesh.vertices)
    small = stage.visibility(cameras).coverage.mean()
    # At distance 2.5 the outline of radius r covers a disc of tan^2(asin(r / 2.5)).
    assert small / large == pytest.approx((0.25 / 6.0) / (1 / 5.25), rel=0.1)
    np.testing.assert_allclose(dense(stage.visibility(cameras)).sum(-1).max(), 1, atol=1e-6)
    with pytest.raises(MeshError):
        stage.move(stage.mesh.vertices[:-1])


def test_a_hundred_uses_do_not_grow(rng):
    stage = Stage(bumpy_sphere(rng), channels=4, background=(0.1, 0.2, 0.3, 0.4))
    generator = torch.Generator().manual_seed(0)

    def use() -> int:
        stage.visibility(random_views(generator, 2, resolution=8))
        stage.move(stage.mesh.vertices * 1.0001)
        return live_variables()

    counts = [use() for _ in range(100)]
    assert counts[-1] <= max(counts[2:10])


def test_the_scene_is_complete(mi):
    stage = Stage(icosphere(2), channels=5, background=0.25)
    params = mi.traverse(stage.scene)
    assert params[Stage.FIELD].shape == (42, 5)
    assert params["integrator.background"].numpy() == pytest.approx([0.25] * 5)


def test_scalar_variants_are_refused(mi):
    mi.set_variant("scalar_rgb")  # given back by the fixture for all tests
    with pytest.raises(ConfigError, match="scalar_rgb"):
        Stage(icosphere(1))


def test_bad_arguments_are_refused():
    stage = Stage(icosphere(1))
    with pytest.raises(ConfigError, match="antialias"):
        stage.visibility(views("perspective"), antialias=0)
    with pytest.raises(ConfigError, match="0 channels"):
        Stage(icosphere(1), channels=0)
    with pytest.raises(ConfigError, match="background"):
        Stage(icosphere(1), channels=3, background=(0.0, 1.0))
    with pytest.raises(ConfigError, match="background"):
        background_values(float("nan"), 2)
