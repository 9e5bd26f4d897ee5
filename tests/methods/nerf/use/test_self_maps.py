"""A captured texture as maps on its own base shape, pictures of patches, and shells of other meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.evaluation.metrics import psnr
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.capture.pixels import Pixels
from mitex.methods.nerf.field.rendering import render_batch, render_rays
from mitex.methods.nerf.synthesis.maps import LatentMaps, MappedLatents, uv_frames
from mitex.methods.nerf.synthesis.patch_images import render_patches
from mitex.methods.nerf.synthesis.patches import PATTERN_RATE, extract_patches
from mitex.methods.nerf.use.placement import EXTENT
from mitex.quilting.plane import Quilt
from tests.methods.nerf.field.test_shell import at, mi, rows, shell
from tests.methods.nerf.tiny import tiny_capture
from tests.methods.nerf.use.self_maps import on_base_shape


@pytest.fixture(scope="module")
def simple(texture) -> NerfTexture:
    """The same field around a ball of fewer faces, which is soon unwrapped."""
    model, ball = texture.model, icosphere(16)
    mesh = Mesh(0.55 * ball.vertices, ball.faces, name="ball")
    return NerfTexture(replace(model, base=replace(model.base, mesh=mesh), frames=face_frames(mesh)))


def test_on_its_own_base_shape_it_gives_the_training_views_back(simple):
    """The promise is 1 dB less than the fit."""
    training, _ = tiny_capture().split()
    again = on_base_shape(simple, 512)
    thickness = again.thickness * again.similarity.scale
    np.testing.assert_allclose(thickness, simple.model.base.thickness, rtol=1e-5)
    losses = []
    for view in range(0, len(training), 4):
        batch, shape = Pixels(training).image(view, 48)
        photo = (batch.colours * batch.alpha + 1 - batch.alpha).numpy()
        moved = replace(batch, origins=again.similarity.apply(batch.origins).astype(np.float32))
        images = [render_batch(field, rays) for field, rays in ((simple.shell, batch), (again, moved))]
        qualities = [psnr(image.reshape(*shape, 3), photo.reshape(*shape, 3)) for image in images]
        losses.append(qualities[0] - qualities[1])
        assert psnr(*(image.reshape(*shape, 3) for image in images)) > 24
    assert np.mean(losses) < 1.0


def test_mirrored_charts_mirror_the_normals():
    """A texture's bump leans to where v grows, whichever way round a chart is."""
    turns = np.eye(3, dtype=np.float32)[None]
    maps = LatentMaps(np.zeros((4, 4, 24), np.float32), np.zeros((4, 4), np.int32), turns, 0.1)
    plain = grid(1, 1)
    uv = np.asarray(plain.uv).copy()
    uv[..., 1] = 1 - uv[..., 1]
    place = at([(0.3, 0.2)])
    axes = [
        np.concatenate(
            [rows(v) for v in MappedLatents(maps, np.asarray(mesh.uv), uv_frames(mesh)).frame(place)]
        )
        for mesh in (plain, replace(plain, uv=uv))
    ]
    np.testing.assert_allclose(axes[0], np.eye(3), atol=1e-6)
    np.testing.assert_allclose(axes[1], np.diag([1, -1, 1]), atol=1e-6)


def test_an_angle_turns_the_texture_on_its_chart():
    """A quarter turn: what points to the texture's right points to where v grows."""
    turns = np.eye(3, dtype=np.float32)[None]
    maps = LatentMaps(np.zeros((4, 4, 24), np.float32), np.zeros((4, 4), np.int32), turns, 0.1)
    mesh, place = grid(1, 1), at([(0.3, 0.2)])
    for angle in (0.5 * np.pi, 0.3):
        turned = replace(maps, angle=np.full((4, 4), angle, np.float32))
        latents = MappedLatents.over(mesh, turned, scale=3.0)
        axes = np.concatenate([rows(v) for v in latents.frame(place)])
        sine, cosine = np.sin(angle), np.cos(angle)
        expected = [[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]
        np.testing.assert_allclose(axes, expected, atol=1e-6)


def test_maps_of_a_mesh_lie_over_its_uvs_once():
    """Whatever the scale; those of the plane are as large as it says."""
    features = np.random.default_rng(0).normal(size=(4, 4, 24)).astype(np.float32)
    maps = LatentMaps(features, np.zeros((4, 4), np.int32), np.eye(3, dtype=np.float32)[None], 0.1)
    own = replace(maps, angle=np.zeros((4, 4), np.float32))
    mesh, place = grid(1, 1), at([(0.3, 0.2), (0.1, 0.6)])
    once, again = (np.array(MappedLatents.over(mesh, own, s).features(place)) for s in (1.0, 2.0))
    np.testing.assert_array_equal(once, again)
    plane = np.array(MappedLatents.over(mesh, maps, 1.0).features(place))
    assert np.abs(plane - np.array(MappedLatents.over(mesh, maps, 2.0).features(place))).max() > 0.1


def test_pictures_of_patches_are_what_is_seen_from_above(texture):
    patches = texture.patches(np.random.default_rng(0), 8)
    whole = render_patches(texture.shell, patches)
    assert whole.shape == (*patches.faces.shape, 3) and whole.min() >= 0 and whole.max() <= 1
    thin = render_patches(texture.shell, patches, every=4)
    np.testing.assert_allclose(thin, whole[:, 2::4, 2::4], atol=1e-5)
    z, reach = patches.frames[3, 2], texture.model.base.thickness
    foot = patches.points[3, 40, 50]
    colour, transmittance = render_rays(texture.shell, (foot + 2 * reach * z)[None], -z[None], far=4 * reach)
    np.testing.assert_allclose(whole[3, 40, 50], (colour / (1 - transmittance))[0].clip(0, 1), atol=1e-4)


def test_a_guide_decides_where_it_is_bright(texture):
    """Dark on the left and bright on the right, or the other way round."""
    guide = np.zeros((2, 2, 3), np.float32)
    guide[:, 1] = 1.0
    x, y = (np.linspace(-0.8, 0.8, 33)[i].ravel() for i in np.mgrid[:33, :33])
    origins = np.stack([x, y, np.full(len(x), 0.9)], 1).astype(np.float32)
    down = np.broadcast_to(np.array([0, 0, -1], np.float32), origins.shape)
    differences = []
    for picture in (guide, 1 - guide):
        maps = texture.synthesize(336, seed=3, patches=80, guide=picture, guide_weight=100.0)
        whole = 2 * EXTENT / (336 * maps.gap)  # the plane shows the texture once
        assert texture.covering(grid(24, 24), whole) == 336
        field = texture.apply(grid(24, 24), maps, scale=whole, density=20.0)
        colour, _ = render_rays(field, origins, down)
        differences.append(colour[x > 0.1].mean() - colour[x < -0.1].mean())
    assert differences[0] > 0.03 and differences[1] < -0.03


@pytest.mark.parametrize(
    ("scale", "rate", "advice"),
    [(20.0, PATTERN_RATE, "smaller scales"), (0.05, PATTERN_RATE / 1000, "larger scales")],
)
def test_guides_over_too_few_or_too_many_texels(texture, scale, rate, advice):
    with pytest.raises(ConfigError, match=advice):
        texture.covering(grid(2, 2), scale, rate)


def test_a_lifted_shell_lies_higher():
    high = shell()
    high.lift = 0.05
    radius = np.linspace(0.45, 0.8, 60)
    points = np.stack([np.zeros(60), radius, np.zeros(60)], 1).astype(np.float32)
    height = high.projection(points).distance - 0.05
    inside = np.flatnonzero(np.abs(height) < high.thickness)
    assert radius[inside].min() > 0.54 and radius[inside].max() > 0.74
    index, coords = high.locate(mi.Point3f(points.T.copy()))
    np.testing.assert_array_equal(np.array(index), inside)
    np.testing.assert_allclose(np.array(coords.distance), height[inside], atol=1e-6)
    np.testing.assert_array_equal(np.flatnonzero(high.density(points)), inside)


def test_lifted_by_one_the_ground_is_on_the_mesh(texture, maps):
    assert -texture.model.base.thickness < texture.ground < 0
    mesh = icosphere(12)
    flat, lifted = (texture.apply(mesh, maps, lift=lift) for lift in (0.0, 1.0))
    assert flat.lift == 0 and abs(lifted.lift + texture.ground) < 1e-6
    size = [np.linalg.norm(field.outline, axis=1).max() for field in (flat, lifted)]
    assert np.isclose(size[1] - size[0], lifted.lift * lifted.similarity.scale, rtol=1e-4)


def test_overlapping_uvs_are_replaced(texture, maps):
    ball = icosphere(12)
    overlapping = np.tile(np.array([[0, 0], [1, 0], [0, 1]], np.float32), (len(ball.faces), 1, 1))
    points = (0.85 * ball.vertices[::3]).astype(np.float32)
    plain, other = (texture.apply(mesh, maps) for mesh in (ball, replace(ball, uv=overlapping)))
    np.testing.assert_array_equal(np.asarray(other.mesh.uv), np.asarray(plain.mesh.uv))
    np.testing.assert_array_equal(other.density(points), plain.density(points))
    own = replace(ball, uv=plain.mesh.uv)
    assert texture.apply(own, maps).mesh.uv is own.uv


def test_a_turned_patch_has_turned_normals(texture):
    """Equation 4: the same place, taken up with another direction as x, shows its normal in other axes."""
    base = texture.model.base
    by_place = []
    for direction in ([1.0, 0.2, 0.1], [0.1, -1.0, 0.4]):
        rng, along = np.random.default_rng(0), np.array(direction)
        # Texels are so fine that those beside the middle lie on the same face, whose frame normals refer to.
        options: dict = {"count": 25, "pattern_rate": 1 / 64, "thickness": base.thickness}
        patches = extract_patches(base.mesh, rng, direction=along, **options)
        normals = [_normal_in_the_middle(texture, patches, k) for k in range(len(patches))]
        places = map(tuple, patches.centres)
        by_place.append(dict(zip(places, zip(patches.frames, normals, strict=True), strict=True)))
    both = [(by_place[0][place], by_place[1][place]) for place in by_place[0].keys() & by_place[1].keys()]
    assert len(both) > 10
    first, second = (np.array([pair[k][1] for pair in both]) for k in (0, 1))
    turns = np.array([pair[1][0] @ pair[0][0].T for pair in both])
    assert np.degrees(np.arccos(turns[:, 0, 0])).mean() > 60 and first[:, :2].std() > 0.02
    np.testing.assert_allclose(second, np.einsum("nij,nj->ni", turns, first), atol=0.05)


def _normal_in_the_middle(texture, patches, k: int) -> np.ndarray:
    """(3,) along the patch's x, y and z, by maps of this patch alone."""
    side = patches.faces.shape[1]
    points = patches.points[k]
    features = texture.features(points.reshape(-1, 3)).reshape(side, side, -1)
    texel = np.moveaxis(np.mgrid[:side, :side], 0, 2).astype(np.int16)
    number = np.full((side, side), k, np.int32)
    maps = texture.maps(patches, Quilt(features, number, np.zeros((side, side), np.uint8), texel))
    latents = MappedLatents(maps, np.array([[[0, 0], [1, 0], [0, 1]]]), np.eye(3)[None])
    place = at([(0.5, 0.5)])
    reflection = texture.decoder(*latents(place), place.distance)
    return rows(reflection.normal(*latents.frame(place)))[0]
