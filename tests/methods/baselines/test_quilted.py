"""The flat texture of table 2: pictures of patches, quilted, and put on meshes."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.errors import CheckpointError, ConfigError, MeshError
from mitex.images import bilinear
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.baselines.quilted import QuiltedTexture, fit, fitting
from mitex.methods.baselines.quilted.albedo import in_even_light, quilted_albedo
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.synthesis.patches import Patches, extract_patches
from mitex.methods.nerf.use.placement import EXTENT
from mitex.quilting.repetition import EVENNESS
from tests.methods.nerf.small import small_texture

SMALL = ["size=128", "patches=4"]  # of a small fit


def checks(patches: Patches) -> np.ndarray:
    """What a plane of blue and orange waves looks like from above."""
    u, v = (0.5 + 0.5 * np.sin(25.0 * patches.points[..., k]) for k in (0, 1))
    return np.stack([u, 0.5 * (u + v), v], -1)


@pytest.fixture(scope="module")
def patches() -> Patches:
    right = np.array([1.0, 0.0, 0.0])
    rng = np.random.default_rng(1)
    return extract_patches(grid(24, 24), rng, count=400, size=32, pattern_rate=0.15, direction=right)


def test_colours_go_on(patches: Patches):
    """The waves stay in step, to the precision that the patches' places allow."""
    image = quilted_albedo(patches, checks(patches), (130, 170), np.random.default_rng(2))
    assert image.shape == (130, 170, 3) and image.dtype == np.float32
    assert image.min() >= 0.0 and image.max() <= 1.0
    assert np.abs(image[..., 1] - 0.5 * (image[..., 0] + image[..., 2])).max() < 1e-5
    # Red varies along columns only, blue along rows only, and no step is much steeper than the waves.
    steepest = 0.5 * 25.0 * patches.gap
    assert np.abs(np.diff(image, axis=0)).max() < 2.0 * steepest
    assert np.abs(np.diff(image, axis=1)).max() < 2.0 * steepest
    assert image[..., 0].std(0).mean() < 0.5 * image[..., 0].std(1).mean()
    assert image[..., 2].std(1).mean() < 0.5 * image[..., 2].std(0).mean()


def test_tileable(patches: Patches):
    image = quilted_albedo(patches, checks(patches), (96, 64), np.random.default_rng(2), tileable=True)
    for axis in (0, 1):
        steps = np.square(np.diff(image, axis=axis)).mean((1 - axis, 2))
        across = np.square(image.take(0, axis) - image.take(-1, axis)).mean()
        assert across <= steps.max()


def test_same_seed_same_image(patches: Patches):
    a, b = (quilted_albedo(patches, checks(patches), (40, 40), np.random.default_rng(3)) for _ in range(2))
    assert (a == b).all()


def test_what_was_used_is_avoided_as_by_our_own_quilting(patches: Patches):
    """With the same options and seed, the default is the one of features."""
    images = [
        quilted_albedo(patches, checks(patches), (96, 96), np.random.default_rng(3), evenness=evenness)
        for evenness in (None, EVENNESS, 0.0)
    ]
    assert (images[0] == images[1]).all() and (images[0] != images[2]).any()


def test_the_light_is_taken_off_patches_of_all_sides():
    """A ball of one colour under a light from the side: in even light all of its patches are alike."""
    ball = icosphere(24)
    patches = extract_patches(ball, np.random.default_rng(0), count=60, size=16)
    light = np.zeros(16)
    light[0], light[3] = np.sqrt(4 * np.pi), -1.6  # brightest towards +x
    normals = ball.face_normals[patches.faces]
    shades = 1.0 + 1.6 * 2 / 3 * np.sqrt(3 / (4 * np.pi)) * normals[..., 0]
    colour = np.array([0.5, 0.4, 0.3])
    pictures = (shades ** (1 / 2.4))[..., None] * colour
    assert pictures.std((0, 1, 2)).min() > 0.02
    even = in_even_light(patches, pictures, ball, light)
    np.testing.assert_allclose(even, np.broadcast_to(colour, even.shape), rtol=1e-4)


def test_refusals(patches: Patches):
    rng = np.random.default_rng(0)
    with pytest.raises(ConfigError, match="pictures of patches of shape"):
        quilted_albedo(patches, checks(patches)[1:], (40, 40), rng)
    with pytest.raises(ConfigError, match="NaN"):
        quilted_albedo(patches, checks(patches) * np.nan, (40, 40), rng)


def captured() -> NerfTexture:
    """The small texture, on a ball with room for patches."""
    model, ball = small_texture().model, icosphere(30)
    mesh = Mesh(0.6 * ball.vertices, ball.faces, name="ball")
    base = replace(model.base, mesh=mesh, scan=0.58 * ball.vertices)
    return NerfTexture(replace(model, base=base, frames=face_frames(mesh)))


@pytest.fixture(scope="module")
def flat(tmp_path_factory) -> QuiltedTexture:
    return fit(captured(), tmp_path_factory.mktemp("flat") / "run", set=SMALL)


def test_a_fit_is_kept(flat: QuiltedTexture, tmp_path):
    again = QuiltedTexture.load(flat.save(tmp_path / "copy.safetensors"))
    assert (again.image == flat.image).all() and again.image.shape == (128, 128, 3)
    assert again.gap == flat.gap and dict(again.about) == dict(flat.about)
    assert again.about["name"] == "small" and again.about["preset"] == "default"
    ball = icosphere(6)
    maps = [texture.apply(ball, resolution=64).maps["albedo"] for texture in (flat, again)]
    assert (maps[0] == maps[1]).all()


def test_it_is_fitted_to_a_model_file_too(flat: QuiltedTexture, tmp_path):
    model = captured().save(tmp_path / "small.safetensors")
    again = fit(model, tmp_path / "run", set=SMALL)
    assert (again.image == flat.image).all() and (
        QuiltedTexture.load(tmp_path / "run").image == again.image
    ).all()


@pytest.mark.parametrize("change", ["size=144", "patches=3", "relit=false", "even=false", "seed=1"])
def test_every_setting_changes_the_picture(flat: QuiltedTexture, tmp_path, change):
    other = fit(captured(), tmp_path / "run", set=[*SMALL, change])
    assert other.image.shape != flat.image.shape or (other.image != flat.image).any()


def plane(side: float) -> Mesh:
    """With UVs that are its places, a unit for the whole."""
    mesh = grid(8, 8)
    points = (mesh.vertices - mesh.vertices.min(0)) / np.ptp(mesh.vertices, axis=0).max()
    uv = points[mesh.faces][..., :2].astype(np.float32)
    return replace(Mesh(side * points, mesh.faces, name="plane"), uv=uv)


def ramp(size: int = 16) -> QuiltedTexture:
    """Red rises along x and green against the rows, upwards; two textures cover the plane at scale 1."""
    place = np.tile((np.arange(size) + 0.5) / size, (size, 1))
    image = np.stack([place, place.T[::-1], np.full_like(place, 0.25)], 2).astype(np.float32)
    return QuiltedTexture(image, EXTENT * 2 / (2 * size))


@pytest.mark.parametrize(("scale", "count"), [(1.0, 2.0), (2.0, 1.0), (0.5, 4.0)])
def test_a_picture_repeats_and_stands_upright(scale, count):
    """Rightwards, and upwards from the corner at the UVs' origin; an element is `scale` times as large."""
    asset = ramp().apply(plane(3.0), scale=scale, resolution=256)
    assert asset.texture_maps is not None
    rng = np.random.default_rng(0)
    uv = rng.uniform(0, 1, (500, 2))
    place = uv * count % 1.0
    inner = ((place > 0.1) & (place < 0.9)).all(1)
    colours = bilinear(asset.texture_maps["albedo"], uv)
    assert np.abs(colours[:, :2] - place)[inner].max() < 0.02
    assert np.abs(colours[:, 2] - 0.25).max() < 1e-3


def test_elements_follow_the_mesh():
    """They have the same size beside the whole mesh, whatever its units are."""
    maps = [ramp().apply(plane(side), resolution=64).maps["albedo"] for side in (0.01, 1.0, 300.0)]
    assert np.abs(maps[0] - maps[1]).max() < 1e-3 and np.abs(maps[2] - maps[1]).max() < 1e-3


def test_texels_show_the_mean_light_of_what_they_cover():
    """Of black and white texels half the light, and not half the sRGB value."""
    squares = np.indices((64, 64)).sum(0) % 2
    texture = QuiltedTexture(np.tile(squares[..., None], 3).astype(np.float32), EXTENT * 2 / 64)
    near, far = (texture.apply(plane(1.0), resolution=size).maps["albedo"] for size in (64, 16))
    assert set(np.unique(near.round(3))) == {0.0, 1.0}
    assert np.abs(far - 0.735357).max() < 1e-3


@pytest.mark.parametrize(("scale", "resolution"), [(0.01, 64), (21.0, 64), (1.0, 8), (1.0, 9000)])
def test_options_out_of_range_are_refused(scale, resolution):
    with pytest.raises(ConfigError, match="`.*` .* is out of range"):
        ramp().apply(plane(1.0), scale=scale, resolution=resolution)


def test_a_mesh_without_an_area_is_refused():
    with pytest.raises(MeshError, match="at one point|no area"):
        ramp().apply(plane(1.0).with_vertices(np.zeros((81, 3))))


@pytest.mark.parametrize(
    ("image", "gap", "why"),
    [
        (np.zeros((4, 5, 3), np.float32), 0.1, "an image of shape"),
        (np.full((4, 4, 3), np.nan, np.float32), 0.1, "not finite, or texels"),
        (np.zeros((4, 4, 3), np.float32), 0.0, "not finite, or texels"),
    ],
)
def test_damaged_files_are_refused(tmp_path, image, gap, why):
    damaged = QuiltedTexture(image, gap, {"name": "flat"}).save(tmp_path / "flat.safetensors")
    with pytest.raises(CheckpointError, match=why):
        QuiltedTexture.load(damaged)


@pytest.mark.parametrize("light", [[np.nan] * 16, [0.0] * 15 + [np.inf]])
def test_a_damaged_light_is_refused(tmp_path, light):
    image = np.zeros((4, 4, 3), np.float32)
    damaged = QuiltedTexture(image, 0.1, {"name": "flat", "light": light}).save(tmp_path / "flat.safetensors")
    with pytest.raises(CheckpointError, match="a light that is not finite"):
        QuiltedTexture.load(damaged)


def test_a_fit_that_fails_leaves_nothing(tmp_path, monkeypatch):
    def black_hole(shell, patches):
        return np.full((*patches.faces.shape, 3), np.nan)

    monkeypatch.setattr(fitting, "render_patches", black_hole)
    with pytest.raises(ConfigError, match="NaN"):
        fit(captured(), tmp_path / "run", set=SMALL)
    assert not list(tmp_path.iterdir())
