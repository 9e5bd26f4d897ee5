"""A captured texture whose patches are joined on the mesh that wears it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitex.atlas import laid_out, usable_uv
from mitex.errors import ConfigError, MeshError, MeshWarning
from mitex.evaluation.seams import ratio_across
from mitex.geometry.triangles import interpolate
from mitex.images import bilinear
from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import texture as texture_module
from mitex.methods.nerf.texture import NerfTexture
from mitex.methods.nerf.use.applied import AppliedTexture
from mitex.methods.nerf.use.placement import carried_picture, own_layout
from mitex.quilting.plane import Quilt
from mitex.quilting.surface import quilt_on
from mitex.quilting.target import SurfaceTarget
from tests.methods.nerf.small import small_texture

SCALE, SIZE = 4.0, 512


@pytest.fixture(scope="module")
def surface(texture: NerfTexture) -> AppliedTexture:
    mesh, maps = texture.synthesize_on(icosphere(10), SIZE, seed=1, scale=SCALE, patches=60)
    return texture.apply(mesh, maps, scale=SCALE)


@pytest.fixture(scope="module")
def plane(texture: NerfTexture, maps) -> AppliedTexture:
    return texture.apply(icosphere(10), maps, scale=SCALE)


def seams(field: AppliedTexture, layout: AppliedTexture) -> float:
    """Of the features, at the borders of a layout's charts."""
    uv = layout.mesh.uv
    assert uv is not None
    step = field._maps.gap * SCALE / 2
    return ratio_across(field.projection.mesh, np.asarray(uv), field.features_at, step)


def test_charts_do_not_show(surface: AppliedTexture, plane: AppliedTexture):
    """Neither those that the texture in the plane breaks at, nor its own."""
    assert seams(plane, plane) > 2.0
    assert seams(surface, plane) < 1.3
    assert seams(surface, surface) < 1.5


def test_features_are_those_of_the_patches(texture: NerfTexture, surface: AppliedTexture):
    """They have the mean and the spread of the features on the captured shape."""
    rng = np.random.default_rng(0)
    base = texture.model.base.mesh
    captured = texture.features(base.vertices[rng.integers(0, len(base.vertices), 2000)])[:, :16]
    face = rng.integers(0, len(surface.mesh.faces), 2000)
    worn = surface.features_at(face, rng.dirichlet([1.0] * 3, 2000))
    assert np.isfinite(worn).all()
    spread = captured.std(0)
    assert (np.abs(worn.mean(0) - captured.mean(0)) < spread).all()
    assert 0.6 < worn.std(0).mean() / spread.mean() < 1.3


def test_normals_are_turned_as_patches_lie(texture: NerfTexture, monkeypatch):
    def turned(angle: float) -> np.ndarray:
        """The maps' angles where all patches lie so."""

        def quilt(_, target: SurfaceTarget, *__: object, **___: object) -> Quilt:
            none = np.zeros((target.texels.side,) * 2, np.int32)
            features = np.zeros((*none.shape, 24), np.float32)
            return Quilt(features, none, none, np.stack([none, none], -1), angle)

        monkeypatch.setattr(texture_module, "quilt_on", quilt)
        maps = texture.synthesize_on(icosphere(3), SIZE, scale=SCALE, patches=4)[1]
        assert maps.angle is not None
        return maps.angle

    np.testing.assert_allclose(turned(0.5) - turned(0.0), 0.5, atol=1e-6)


def test_the_option_says_where_patches_are_joined(texture: NerfTexture, monkeypatch):
    """By default on the surface; with a guide in the plane."""
    calls = []
    flat = texture.synthesize(128, patches=30)

    def on(mesh: Mesh, *_: object, **options: object):
        calls.append(("surface", options["scale"]))
        return replace(mesh, uv=own_layout(mesh, 0.1, 64)[0].uv), replace(
            flat, angle=0 * flat.features[..., 0]
        )

    def in_plane(*_: object, **__: object):
        calls.append("plane")
        return flat

    monkeypatch.setattr(texture, "synthesize_on", on)
    monkeypatch.setattr(texture, "synthesize", in_plane)
    monkeypatch.setattr(texture, "covering", lambda *_: 128)
    mesh = icosphere(3)
    texture.apply(mesh, scale=2.0)
    texture.apply(mesh, scale=2.0, quilting="surface")
    texture.apply(mesh, scale=2.0, quilting="plane")
    texture.apply(mesh, scale=2.0, guide=np.zeros((4, 4, 3), np.float32))
    assert calls == [("surface", 2.0), ("surface", 2.0), "plane", "plane"]


def test_too_fine_for_the_surface_it_is_quilted_in_the_plane(texture: NerfTexture, monkeypatch):
    flat = texture.synthesize(128, patches=30)
    monkeypatch.setattr(texture, "synthesize", lambda *_, **__: flat)
    with pytest.warns(MeshWarning, match="blurs them.*in the plane"):
        field = texture.apply(icosphere(2), size=128, scale=0.2)
    assert field._maps is flat


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"quilting": "sphere"}, "unknown quilting"),
        ({"quilting": "surface", "scale": 2.0, "guide": np.zeros((4, 4))}, "a guide of shape"),
        ({"scale": 0.05, "size": 128, "quilting": "surface"}, "blurs them"),
        ({"scale": 0.0}, "`scale` 0 is out of range"),
        ({"seed": -1, "scale": 2.0}, "`seed` -1 is out of range"),
        ({"seed": -1, "quilting": "plane"}, "`seed` -1 is out of range"),
    ],
)
def test_refusals(options: dict, message: str):
    with pytest.raises(ConfigError, match=message):
        small_texture().apply(icosphere(2), **options)


def test_a_mesh_without_an_area_is_refused():
    flat = Mesh(np.zeros((3, 3), np.float32) + [[0, 0, 0], [1, 0, 0], [2, 0, 0]], np.array([[0, 1, 2]]))
    with pytest.raises(MeshError, match="no area"):
        small_texture().synthesize_on(flat)


def test_the_layout_is_the_maps_own():
    """With room at the border of the square, and no larger than it has to be."""
    ball = icosphere(6)
    overlapping = np.tile(np.array([[0, 0], [1, 0], [0, 1]], np.float32), (len(ball.faces), 1, 1))
    plain, side = own_layout(ball, 0.02, 2048)
    other, _ = own_layout(replace(ball, uv=overlapping), 0.02, 2048)
    assert plain.uv is not None and side is not None
    np.testing.assert_array_equal(np.asarray(other.uv), np.asarray(plain.uv))
    assert usable_uv(plain, np.asarray(plain.uv))
    assert plain.uv.min() >= 0.99 / side and plain.uv.max() <= 1 - 0.99 / side
    _, twice = own_layout(ball, 0.01, 2048)
    assert twice is not None and 1.8 < twice / side < 2.2
    assert own_layout(ball, 0.01, 16)[1] is None
    assert own_layout(ball, 0.02, 100)[1] == 100
    assert own_layout(ball, 5.0, 100)[1] == 16


def test_a_picture_on_another_layout():
    """Seen through either, each point of the mesh has the same colour."""
    first = laid_out(icosphere(4), 512)
    uv = np.asarray(first.uv)
    second = replace(first, uv=0.5 * uv[..., ::-1] + 0.25)
    picture = np.random.default_rng(0).random((3, 3, 3)).astype(np.float32)
    carried = carried_picture(picture, first, second, 400)
    rng = np.random.default_rng(1)
    face, weights = rng.integers(0, len(uv), 500), rng.dirichlet([2.0] * 3, 500)
    seen = bilinear(carried, interpolate(weights, np.asarray(second.uv)[face]))
    assert np.abs(seen - bilinear(picture, interpolate(weights, uv[face]))).max() < 0.02


def test_a_guide_on_the_surface_decides_where_it_is_bright(texture: NerfTexture, monkeypatch):
    """Its colours lie at the texels by the given UVs, and those of the patches beside them."""
    guides = []

    def quilt(source, target: SurfaceTarget, rng, *, guide, evenness):
        guides.append((guide, target))
        return quilt_on(source, target, rng, guide=guide, evenness=evenness)

    monkeypatch.setattr(texture_module, "quilt_on", quilt)
    mesh = laid_out(icosphere(3), 512)
    half = np.zeros((2, 2, 3), np.float32)
    half[:, 1] = 1
    texture.synthesize_on(mesh, SIZE, scale=SCALE, patches=12, guide=half, guide_weight=3.0)
    ((guide, target),) = guides
    assert guide.count == len(guide.colours) <= 12 and guide.weight == 3.0
    assert len(guide.texels) == target.count and 0.2 < guide.texels.mean() < 0.8
