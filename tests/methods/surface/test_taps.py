"""Taps and groups on real surfaces: partition, connectedness, bending, boundaries, the way back."""

import math

import numpy as np
import pytest
import torch
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mitex.atlas import unwrap
from mitex.mesh import Mesh, embedded
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.levels import Levels
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.taps import Surroundings, build, representatives
from mitex.texels import Texels
from tests.mesh.examples import tangent_frames


def surroundings(mesh: Mesh, uv: np.ndarray, resolution: int, **options) -> Surroundings:
    texels = Texels.rasterize(mesh, uv, resolution)
    frames = tangent_frames(mesh, texels.face, texels.barycentric, "fixed")
    return Surroundings(texels, GeodesicTracer(mesh), *frames, **options)


@pytest.fixture(scope="module")
def octopus():
    mesh = embedded("octopus")
    around = surroundings(mesh, unwrap(mesh, 128, 2), 128)
    return around, build(around)


def readings(levels: Levels) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of elements: who reads whom in the first convolution."""
    row, read = levels.lookup.tocoo().coords
    return row // 9, read


def parents(levels: Levels, level: int) -> np.ndarray:
    """(N,) the element of a level that each texel of level 0 belongs to."""
    label = np.arange(len(levels.order))
    for n in range(level):
        label = np.repeat(np.arange(len(levels.levels[n].sizes)), levels.levels[n].sizes)[label]
    return label


def test_every_texel_is_in_one_group_of_every_level(octopus):
    around, levels = octopus
    assert np.array_equal(np.sort(levels.order), np.arange(len(around.texels.index)))
    count = len(levels.order)
    for level in levels.levels:
        assert len(level.taps) == count == level.sizes.sum() and level.sizes.min() >= 1
        assert level.taps.min() >= 0 and level.taps.max() < count
        count = len(level.sizes)


def test_groups_are_connected_and_lie_in_a_voxel(octopus):
    around, levels = octopus
    reader, read = readings(levels)
    position = around.texels.position[levels.order]
    for n in range(1, 6):
        label = parents(levels, n)
        same = label[reader] == label[read]
        graph = coo_array((np.ones(same.sum(), bool), (reader[same], read[same])), shape=(len(label),) * 2)
        assert connected_components(graph, directed=False)[0] == label.max() + 1
        low, high = np.full((label.max() + 1, 3), np.inf), np.full((label.max() + 1, 3), -np.inf)
        np.minimum.at(low, label, position)
        np.maximum.at(high, label, position)
        assert (high - low).max() <= 2**n * around.texels.size * (1 + 1e-6)


def test_groups_join_about_four(octopus):
    ratios = [len(level.taps) / len(level.sizes) for level in octopus[1].levels]
    assert all(2.8 < ratio < 4.8 for ratio in ratios[:4]), ratios


def test_taps_read_themselves_or_neighbours(octopus):
    """Overshooting is corrected: a tap of a group reads that group or an adjacent one."""
    _, levels = octopus
    reader, read = readings(levels)
    for n in range(1, 5):
        label = parents(levels, n)
        count = label.max() + 1
        pairs = [label[reader] * count + label[read], label[read] * count + label[reader]]
        known = np.unique(np.concatenate(pairs))
        taps = levels.levels[n].taps
        tap_pairs = np.arange(count)[:, None] * count + taps
        assert np.isin(tap_pairs, known).all()


def test_without_the_correction_some_taps_overshoot(octopus):
    around, levels = octopus
    loose = build(Surroundings(around.texels, around.tracer, around.right, around.up, correct=False))
    assert np.array_equal(loose.levels[0].taps, levels.levels[0].taps)
    assert (loose.levels[3].taps != levels.levels[3].taps).mean() > 0.01


def test_bilinear_taps_are_where_the_geodesics_end(octopus):
    """The interpolated position is a texel away from the centre, but for chords, charts and borders."""
    around, levels = octopus
    position = around.texels.position[levels.order]
    there = (levels.lookup @ position).reshape(-1, 9, 3)
    away = np.linalg.norm(there - position[:, None], axis=2) / around.texels.size
    assert np.allclose(levels.lookup.sum(axis=1), 1, atol=1e-5)
    straight, diagonal = away[:, [1, 3, 5, 7]], away[:, [0, 2, 6, 8]]
    assert abs(np.median(straight) - 1) < 0.05 and abs(np.median(diagonal) - math.sqrt(2)) < 0.07
    assert away[:, 4].max() == 0


def bent(columns: int, rows: int, angle: float) -> Mesh:
    """A strip of height 1 and width 2 standing upright, bent along its columns by `angle` in all [rad].

    Folded, not stretched: every strip of faces between two columns stays flat and congruent.
    """
    step = 2.0 / columns
    turn = angle / columns
    heading = turn * (np.arange(columns) - (columns - 1) / 2)
    x = np.concatenate([[0], np.cumsum(step * np.cos(heading))])
    z = np.concatenate([[0], np.cumsum(-step * np.sin(heading))])
    y = np.linspace(0, 1, rows + 1)
    points = np.stack([np.tile(x, rows + 1), np.repeat(y, columns + 1), np.tile(z, rows + 1)], 1)
    u = np.tile(np.arange(columns + 1) / columns, rows + 1)
    plane = np.stack([u, 0.5 * np.repeat(y, columns + 1)], 1)
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    return Mesh(points, faces, plane[faces], "strip")


def test_bending_changes_no_feature_before_pooling():
    """Isometric invariance. Pooling is by voxels of space, which bending does move."""
    colours = torch.rand(96 * 96, 3, generator=torch.Generator().manual_seed(0))
    results = []
    for angle in (0.0, 2.5):
        mesh = bent(24, 8, angle)
        assert mesh.uv is not None
        around = surroundings(mesh, mesh.uv, 96)
        levels = build(around)
        texels = colours[torch.from_numpy(around.texels.index[levels.order]).long()]
        features = SurfaceVgg(levels, precision="float32").features(texels, ["relu1_1", "relu1_2"])
        back = np.argsort(levels.order)
        results.append({name: f[torch.from_numpy(back)] for name, f in features.items()})
        row, column = np.divmod(around.texels.index, 96)
        inner = torch.from_numpy((row > row.min() + 3) & (row < 92) & (column > 3) & (column < 92))
    flat, round_ = results
    for name, f in flat.items():
        worst = (f - round_[name])[inner].abs().max() / f[inner].abs().mean()
        assert worst < 1e-3, name


def test_taps_across_a_border_are_the_opposite_ones():
    mesh = bent(8, 4, 0.0)
    assert mesh.uv is not None
    around = surroundings(mesh, mesh.uv, 32)
    levels = build(around)
    row, column = np.divmod(around.texels.index[levels.order], 32)
    taps = levels.levels[0].taps
    left = np.flatnonzero((column == 0) & (row > row.min() + 1) & (row < 30))
    assert len(left) > 5
    assert np.array_equal(taps[left, 3], taps[left, 5])
    assert np.array_equal(column[taps[left, 5]], np.ones(len(left)))
    inner = np.flatnonzero((column == 9) & (row > row.min() + 1) & (row < 30))
    assert np.array_equal(column[taps[inner, 3]], np.full(len(inner), 8))
    assert np.array_equal(row[taps[inner, 7]], row[inner] + 1)  # tap 7 is below


def test_representatives_are_nearest_to_the_mean():
    rng = np.random.default_rng(1)
    position, labels = rng.random((60, 3)), np.sort(rng.integers(0, 7, 60))
    members = representatives(position, labels, 0.01)
    for k in range(7):
        own = np.flatnonzero(labels == k)
        distance = np.linalg.norm(position[own] - position[own].mean(0), axis=1)
        assert distance[own == members[k]][0] <= distance.min() + 1e-5
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
    assert representatives(square, np.zeros(4, int), 1.0).tolist() == [0]  # all alike: the first


def test_two_sheets_close_together_do_not_mix():
    """Within one voxel, but not connected in it: two groups, and no tap crosses (figure 3)."""
    one = bent(8, 4, 0.0)
    assert one.uv is not None
    count = len(one.vertices)
    apart = one.vertices + np.array([0, 0, 1e-3], np.float32)
    uv = np.concatenate([one.uv, one.uv + np.array([0, 0.5], np.float32)])
    mesh = Mesh(np.concatenate([one.vertices, apart]), np.concatenate([one.faces, one.faces + count]), uv)
    around = surroundings(mesh, uv, 64)
    levels = build(around)
    sheet = (around.texels.face[levels.order] >= len(one.faces)).astype(int)
    for n, level in enumerate(levels.levels):
        label = parents(levels, n)
        of = sheet[np.unique(label, return_index=True)[1]]
        assert np.array_equal(np.unique(np.stack([label, sheet]), axis=1)[0], np.arange(len(level.taps)))
        assert np.array_equal(of[level.taps], np.repeat(of[:, None], 9, 1))
