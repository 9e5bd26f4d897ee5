"""Textures beside their exemplar: what is measured of a plane that wears it, or something else."""

from dataclasses import fields

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.comparison import look_pair
from mitex.comparison.look_pair import LookPair
from mitex.evaluation.likeness import Likeness
from mitex.evaluation.patches import patch_cameras
from mitex.mesh.shapes import grid

SIDE = 96  # of the exemplar [px]
LIKENESS = {field.name for field in fields(Likeness)}


def dots():
    """(S, S, 3): eight rows of eight."""
    y, x = np.mgrid[:SIDE, :SIDE] * (2 * np.pi * 8 / SIDE)
    return np.repeat((0.5 + 0.25 * (np.cos(x) + np.cos(y)))[..., None], 3, axis=2).astype(np.float32)


def noise():
    return np.random.default_rng(0).random((SIDE, SIDE, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def plane():
    """Two exemplars wide, a vertex for each pixel."""
    return grid(2 * SIDE, 2 * SIDE)


@pytest.fixture
def few_patches(monkeypatch):
    monkeypatch.setattr(look_pair, "PATCHES", 3)


@pytest.fixture
def pair_of(plane, monkeypatch):
    """Makes the pair of an exemplar and the plane."""

    def pair_of(image):
        monkeypatch.setattr(look_pair, "picture_of", lambda _: image)
        monkeypatch.setattr(look_pair, "sized_mesh", lambda _: (plane, 1.0))
        return LookPair("exemplar", "plane")

    return pair_of


def wearing(plane, image):
    """The plane with an image on it twice each way, whose pixels are as large as the exemplar's."""
    row, column = (np.round((plane.vertices[:, k] + 1) * SIDE).astype(int) % SIDE for k in (1, 0))
    return Asset(plane, {"albedo": image[row, column]})


@pytest.mark.usefixtures("few_patches")
def test_repetition_is_beyond_that_of_the_exemplar(pair_of, plane):
    """Dots in rows have a regularity near 1, noise near 0: the difference is told, with its sign.

    The plane wears the whole image several times: that is beyond the shifts, and not seen.
    """
    of_dots, of_noise = pair_of(dots()), pair_of(noise())
    of = {
        (name, worn): pair.numbers(wearing(plane, image))["repetition"]
        for name, pair in (("dots", of_dots), ("noise", of_noise))
        for worn, image in (("dots", dots()), ("noise", noise()))
    }
    assert of["dots", "dots"] == pytest.approx(0, abs=0.1) == of["noise", "noise"]
    assert of["dots", "noise"] < -0.5 and of["noise", "dots"] > 0.5


@pytest.mark.usefixtures("few_patches")
def test_the_exemplar_beside_itself_is_nearer_than_another_texture(pair_of, plane):
    pair = pair_of(dots())
    floor, other = pair.floor(), pair.numbers(wearing(plane, noise()))
    assert floor.keys() == LIKENESS and floor == pair.floor()
    assert all(0 < floor[key] < other[key] for key in LIKENESS)


def test_patches_and_windows_are_as_wide_as_the_report_says(pair_of, plane, monkeypatch):
    """16 patches, three eighths of the exemplar wide; windows as wide as it; pixels as large as its own."""
    asked = []

    def cameras(mesh, count, width, pixels):
        asked.append((count, width, pixels))
        return patch_cameras(mesh, count, width, pixels)

    monkeypatch.setattr(look_pair, "patch_cameras", cameras)
    numbers = pair_of(dots()).numbers(wearing(plane, dots()))
    assert numbers.keys() == LIKENESS | {"seams", "repetition"}
    assert sorted(asked) == [(6, 1.0, SIDE), (16, 3 / 8, 3 * SIDE // 8)]
