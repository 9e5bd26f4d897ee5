"""How deep a relief is, by formula."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.geometry.normal_maps import of_slopes, slopes
from mitex.methods.relief.depth import with_depth
from tests.methods.relief.waves import AMPLITUDE, waves

DEPTH = 3 * AMPLITUDE  # from the lowest to the highest point


def test_normals_say_how_deep_a_height_map_is():
    exemplar, depth = with_depth(waves("height", "normal"))
    assert depth == pytest.approx(DEPTH, rel=0.03)  # slopes of maps are those of chords
    assert exemplar.maps.keys() == {"height", "normal"}


def test_rough_maps_do_not_look_deeper():
    """Noise of the normals has no part in the heights, and noise of the heights none in the normals."""
    noise = np.random.default_rng(0)
    plain = waves("height", "normal", side=256)
    rough = {
        "normal": of_slopes(slopes(plain.maps["normal"]) + 0.1 * noise.standard_normal((256, 256, 2))),
        "height": np.round(plain.maps["height"] * 255) / np.float32(255),
    }
    assert with_depth(Exemplar(rough, "rough"))[1] == pytest.approx(DEPTH, rel=0.03)


def test_normals_alone_are_integrated():
    exemplar, depth = with_depth(waves("normal", side=128))
    assert depth == pytest.approx(DEPTH, rel=0.03)
    heights = waves("height", side=128).maps["height"]
    assert np.abs(exemplar.maps["height"] - heights).max() < 0.02
    assert exemplar.maps["height"].min() == 0 and exemplar.maps["height"].max() == 1


def test_normals_of_a_picture_that_does_not_repeat():
    """A slope from one side to the other: its mirror image continues it."""
    rise = np.zeros((48, 64, 2))
    rise[..., 0] = 0.2
    exemplar, depth = with_depth(Exemplar({"normal": of_slopes(rise)}, "slope"))
    assert depth == pytest.approx(0.2 * 64 / 48, rel=0.05)  # 64 pixels, in widths of the square of 48
    row = exemplar.maps["height"][24, :, 0]
    assert (np.diff(row[2:-2]) > 0).all()


def test_a_height_map_alone_has_the_depth_that_is_given_and_its_normals():
    exemplar, depth = with_depth(waves("height"), DEPTH)
    assert depth == DEPTH
    inner = (slice(2, -2), slice(2, -2))  # derivatives at borders are one-sided
    assert np.abs(exemplar.maps["normal"] - waves("normal").maps["normal"])[inner].max() < 0.01


def test_depth_is_that_from_black_to_white():
    """A map that uses a fifth of its range has a fifth of the depth."""
    maps = waves("height").maps
    exemplar, depth = with_depth(Exemplar({"height": 0.4 + 0.2 * maps["height"]}, "pale"), 5 * DEPTH)
    assert depth == 5 * DEPTH
    inner = (slice(2, -2), slice(2, -2))
    assert np.abs(exemplar.maps["normal"] - waves("normal").maps["normal"])[inner].max() < 0.01


def test_a_given_depth_makes_normals_steeper():
    exemplar, depth = with_depth(waves("height", "normal"), 2 * DEPTH)
    assert depth == 2 * DEPTH
    steep, plain = (slopes(e.maps["normal"])[5:-5, 5:-5] for e in (exemplar, waves("normal")))
    assert np.abs(steep - 2 * plain).max() < 0.03


def test_a_given_depth_counts_where_normals_say_something_else():
    """Heights turned over: their slopes are the opposite of the normals'."""
    maps = waves("height", "normal").maps
    other = Exemplar(maps | {"height": 1 - maps["height"]}, "other")
    with pytest.raises(ConfigError, match="of its width deep"):
        with_depth(other)
    exemplar, depth = with_depth(other, DEPTH)
    assert depth == DEPTH
    turned, plain = (slopes(e.maps["normal"])[5:-5, 5:-5] for e in (exemplar, waves("normal")))
    assert np.abs(turned + plain).max() < 0.03


def test_other_maps_stay():
    plain = waves("height", "normal", "albedo")
    assert np.array_equal(with_depth(plain)[0].maps["albedo"], plain.maps["albedo"])


@pytest.mark.parametrize(
    ("exemplar", "depth", "problem"),
    [
        (waves("albedo"), 0.1, "no height map and no normals"),
        (waves("height"), 0.0, "no normals, which would say how deep"),
        (Exemplar({"normal": of_slopes(np.zeros((16, 16, 2)))}, "flat"), 0.0, "of its width deep"),
        (
            Exemplar(
                {
                    "height": np.full((16, 16, 1), 0.5, np.float32),
                    "normal": waves("normal", side=16).maps["normal"],
                },
                "even",
            ),
            0.0,
            "of its width deep",
        ),
    ],
)
def test_what_is_refused(exemplar, depth, problem):
    with pytest.raises(ConfigError, match=problem):
        with_depth(exemplar, depth)


def test_a_height_map_of_one_grey_is_refused_at_any_depth():
    maps = waves("height", "normal").maps
    for flat in ({"height": 0 * maps["height"] + 0.5}, maps | {"height": 0 * maps["height"]}):
        with pytest.raises(ConfigError, match="of one grey"):
            with_depth(Exemplar(flat, "flat"), 0.05)
