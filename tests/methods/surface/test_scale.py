"""The size of the pattern: the exemplar's side, and taps whose step varies over the surface."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from mitex.errors import CheckpointError, ConfigError, ImageError, MitexError
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import Mesh, icosphere, torus
from mitex.methods import surface
from mitex.methods.layout import layout_ratio, layout_side, with_layout
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.scale_map import ScaleMap
from mitex.methods.surface.taps import Surroundings, build
from mitex.texels import Texels
from mitex.training import resolve
from tests.mesh.examples import tangent_frames
from tests.methods.surface.grids import flat_square
from tests.methods.surface.small import SHALLOW

pytestmark = pytest.mark.usefixtures("own_cache")
SIDE = 64
config = partial(resolve, PRESETS, None, None)


def test_the_exemplar_is_as_wide_on_the_mesh_at_every_resolution():
    for words, side in (
        ([], 256),
        (["resolution=1024"], 512),
        (["scale=0.5"], 128),
        (["scale=2", "resolution=256"], 256),
        (["exemplar_size=200", "resolution=1024"], 200),
        (["exemplar_size=200", "scale=0.5"], 100),
        (["preset=paper", "resolution=1024"], 256 * 2),
    ):
        assert config(words).exemplar_side() == side
    assert config([]).exemplar_side(0.5) == 128
    for words in (["scale=0.05"], ["scale=20"], ["resolution=16"]):
        with pytest.raises(ConfigError, match=r"texels wide with a scale of .*; change scale, resolution or"):
            config(words)


@pytest.mark.parametrize("resolution", [96, 256, 1024])
def test_the_pattern_is_as_wide_on_a_mesh_at_every_resolution(resolution):
    """Charts with gaps of two texels between them take less of the square the smaller it is."""
    mesh = torus(24, 12)
    side_at_512 = layout_side(with_layout(mesh, 512))
    wanted = config([f"resolution={resolution}"])
    unwrapped = with_layout(mesh, resolution)
    ratio = layout_ratio(mesh, unwrapped, resolution)
    domain = SurfaceDomain.of(unwrapped, wanted, keep=False, layout_ratio=ratio)
    width = domain.exemplar_side(wanted) / resolution * layout_side(unwrapped)
    assert width == pytest.approx(0.5 * side_at_512, rel=0.5 / (0.4 * resolution))
    own = layout_side(unwrapped) / side_at_512
    assert ratio == pytest.approx(own) and (resolution != 96 or own > 1.1)
    assert layout_ratio(mesh, unwrapped, resolution, keep_uvs=True) == 1.0
    assert wanted.exemplar_side(1.0, ratio) != wanted.exemplar_side() or resolution == 1024
    asked = config([f"resolution={resolution}", "exemplar_size=77"])
    assert domain.exemplar_side(asked) == 77


def test_a_fit_reads_the_exemplar_at_that_width(monkeypatch):
    sides = []
    resized = Exemplar.resized
    monkeypatch.setattr(Exemplar, "resized", lambda self, side: sides.append(side) or resized(self, side))
    small = {"resolution": 96, "steps": 1, "layers": "relu1_1", "start": "noise"}
    mesh = icosphere(4)
    surface.fit(Exemplar.load("cobblestone").of_albedo(), mesh, set=small)
    ratio = layout_ratio(mesh, with_layout(mesh, 96), 96)
    assert ratio > 1.05 and round(48 / ratio) in sides and 48 not in sides


def test_the_smallest_exemplar_is_wide_enough_for_the_network():
    """Half of 32 texels are 16 pixels, which gaps in the layout make no fewer."""
    small = config(["resolution=32"])
    assert small.exemplar_side() == small.exemplar_side(1.0, 1.6) == 16
    assert config(["resolution=64"]).exemplar_side(1.0, 1.6) == 20


def square_levels(steps):
    """Texels and levels of a flat square of 64 x 64 texels, whose taps are `steps` of the texels apart."""
    mesh = flat_square(8)
    assert mesh.uv is not None
    texels = Texels.rasterize(mesh, mesh.uv, SIDE)
    frames = tangent_frames(mesh, texels.face, texels.barycentric, "fixed")
    widths = steps(texels.position)
    levels = build(Surroundings(texels, GeodesicTracer(mesh), *frames, steps=widths))
    return texels, widths[levels.order], levels


def reach(levels):
    """(n,) how far to the right of its element the tap to the right reads in the mean [texels]."""
    x = levels.position[:, 0].astype(np.float64)
    return SIDE * ((levels.lookup @ x).reshape(-1, 9)[:, 5] - x)


def inner(levels, margin):
    return (np.abs(levels.position[:, :2] - 0.5) < 0.5 - margin / SIDE).all(1)


@pytest.mark.parametrize("step", [0.5, 2.0])
def test_taps_and_groups_are_as_many_times_larger_on_every_level(step):
    _, _, levels = square_levels(lambda position: np.full(len(position), step))
    inside = inner(levels, 6)
    assert np.allclose(reach(levels)[inside], step, atol=0.02)
    for n in (1, 2, 3):
        sides = np.bincount(groups(levels, n))
        assert np.median(sides) == max(step * 2**n, 1) ** 2
        here, there = levels.positions[n][:, 0], levels.positions[n][levels.levels[n].taps[:, 5], 0]
        middle = (np.abs(levels.positions[n][:, :2] - 0.5) < 0.2).all(1)
        assert np.allclose(SIDE * (there - here)[middle], step * 2**n, atol=0.6)


def groups(levels, depth):
    """(n,) the group of each element after so many poolings."""
    label = np.arange(len(levels.order))
    for level in levels.levels[:depth]:
        label = np.repeat(np.arange(len(level.sizes)), level.sizes)[label]
    return label


def test_steps_follow_a_map_and_pass_over_no_texel():
    """A step that grows from left to right; wide steps read all that is between them, evenly."""
    _, widths, levels = square_levels(lambda position: 1 + 2 * position[:, 0])
    inside = inner(levels, 10)
    assert np.abs(reach(levels)[inside] / widths[inside] - 1).max() < 0.06
    assert np.allclose(levels.lookup.sum(1), 1, atol=1e-5)
    read = np.asarray(levels.lookup.sum(0))[inside]
    assert read.min() > 3 and read.max() < 20  # each element by about nine taps, none by chance alone
    for n in range(1, 5):  # groups of a level lie in one group of the next
        fine, coarse = groups(levels, n), groups(levels, n + 1)
        assert (np.diff(fine)[np.diff(coarse) != 0] == 1).all()


def test_a_constant_map_is_a_scale():
    mesh = flat_square(4)
    halved = config(["resolution=64", "scale=0.5"])
    half = config(["resolution=64", "scale=1"])
    plain = SurfaceDomain.of(mesh, halved, keep=False)
    mapped = SurfaceDomain.of(mesh, half, scale_map=ScaleMap.of(np.full(25, 0.5), mesh), keep=False)
    assert half.exemplar_side(mapped.mean_scale) == halved.exemplar_side()
    for ours, theirs in zip(mapped.levels.levels, plain.levels.levels, strict=True):
        assert np.array_equal(ours.taps, theirs.taps) and np.array_equal(ours.sizes, theirs.sizes)
    assert abs(mapped.levels.lookup - plain.levels.lookup).max() < 1e-5


def test_a_picture_lies_on_the_mesh_s_own_uvs(tmp_path):
    """A linear ramp over the UVs, 0.25 to 1 from left to right, as numbers at the vertices give it, too."""
    mesh = flat_square(8)
    ramp = 0.25 + 0.75 * (np.arange(200) + 0.5) / 200
    write_image(tmp_path / "ramp.png", np.tile(ramp, (50, 1)))
    domain = SurfaceDomain.of(mesh, config(["resolution=64"]))
    at = domain.texels.face, domain.texels.barycentric
    expected = 0.25 + 0.75 * domain.texels.position[:, 0]
    np.save(tmp_path / "ramp.npy", 0.25 + 0.75 * mesh.vertices[:, 0])
    for name in ("ramp.png", "ramp.npy"):
        factors = ScaleMap.of(tmp_path / name, mesh).at(mesh, *at)
        assert np.abs(factors - expected).max() < 0.005
    mapped = SurfaceDomain.of(
        mesh, config(["resolution=64"]), scale_map=ScaleMap.of(tmp_path / "ramp.npy", mesh)
    )
    assert mapped.steps is not None
    assert np.isclose(np.log(mapped.steps).mean(), 0, atol=1e-9)
    assert np.allclose(mapped.steps * mapped.mean_scale, expected)


def test_a_picture_repeats_beyond_its_square(tmp_path):
    """As UVs do in glTF and OBJ; the border itself is that of the square."""
    plain = flat_square(4)
    assert plain.uv is not None
    write_image(tmp_path / "ramp.png", np.tile(0.25 + 0.75 * (np.arange(200) + 0.5) / 200, (50, 1)))
    at = np.zeros(3, int), np.array([[1.0, 0, 0], [0, 1, 0], [1 / 3, 1 / 3, 1 / 3]])
    factors = [
        ScaleMap.of(tmp_path / "ramp.png", replace(plain, uv=plain.uv + shift)).at(plain, *at)
        for shift in (0, 2, -3)
    ]
    assert np.ptp(factors[0]) > 0.1
    for shifted in factors[1:]:
        assert np.abs(shifted[1:] - factors[0][1:]).max() < 1e-4
    right = replace(plain, uv=np.ones_like(plain.uv))
    assert ScaleMap.of(tmp_path / "ramp.png", right).at(right, *at) == pytest.approx(1, abs=0.01)


def test_the_map_changes_the_texture():
    small = {"resolution": 32, "exemplar_size": 32, "steps": 1, "scales": 0}
    small |= {"layers": "relu1_1", "start": "noise"}
    mesh, exemplar = icosphere(3), Exemplar.load("cobblestone").of_albedo()
    sizes = np.where(mesh.vertices[:, 1] > 0, 1.0, 0.5)
    plain, mapped = (surface.fit(exemplar, mesh, set=small, scale_map=m).values for m in (None, sizes))
    assert np.abs(plain - mapped).max() > 1e-2


@pytest.mark.parametrize(("before", "after"), [(None, 0.5), (0.5, None), (0.5, 2.0)])
def test_resuming_with_another_map_is_refused(before, after, tmp_path):
    mesh = flat_square(2)
    maps = {factor: np.linspace(factor, 1, 9) for factor in (0.5, 2.0)}
    fit = partial(surface.fit, Exemplar.load("cobblestone").of_albedo(), mesh, tmp_path / "run")
    fit(set=[*SHALLOW, "steps=1"], scale_map=maps.get(before))
    with pytest.raises(CheckpointError, match="the scale_map is not the one that the run began with"):
        fit(set=["steps=2"], scale_map=maps.get(after), resume=True)
    fit(set=["steps=2"], scale_map=maps.get(before), resume=True)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (np.ones(5), r"float64 \(5,\); give numbers of shape \(25,\)"),
        (np.full(25, np.nan), "NaN"),
        (np.full(25, 5.0), "goes from 5 to 5 on 'square'; use factors from 0.25 to 4"),
        (np.full(25, "a"), "give numbers"),
        (np.zeros((4, 4)), "0.25 to 4"),
    ],
)
def test_bad_maps(source, message, tmp_path):
    mesh = flat_square(4)
    if source.shape == (4, 4):
        source = write_image(tmp_path / "black.png", source)
    with pytest.raises(ConfigError, match=message):
        ScaleMap.of(source, mesh).at(mesh, np.array([0]), np.full((1, 3), 1 / 3))


def test_a_picture_needs_uvs(tmp_path):
    bare = Mesh(flat_square(4).vertices, flat_square(4).faces)
    with pytest.raises(ImageError, match="does not exist"):
        ScaleMap.of(tmp_path / "a.png", bare)
    with pytest.raises(ConfigError, match="has no UVs for the scale map"):
        ScaleMap.of(write_image(tmp_path / "a.png", np.ones((4, 4))), bare)


@pytest.mark.parametrize("option", ["orientation", "scale_map"])
@pytest.mark.parametrize("source", ["no.npy", np.zeros((92, 1))], ids=["missing", "invalid"])
def test_bad_files_are_refused_before_the_mesh_is_unwrapped(option, source, monkeypatch):
    monkeypatch.delattr("mitex.methods.surface.fitting.with_layout")
    bad: dict[str, Any] = {option: source}
    with pytest.raises(MitexError, match=r"no\.npy|\(92, 1\)"):
        surface.fit(Exemplar.load("cobblestone").of_albedo(), icosphere(3), **bad)
