"""The coarse part of a relief: what of it is taken, and what is laid like it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from mitex.errors import ConfigError
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh, icosphere, torus
from mitex.mesh.fields import vector_field
from mitex.mesh.low_pass import blurred
from mitex.methods.geometric import coarse_patches, coarse_relief
from mitex.methods.geometric.coarse_patches import PATCH, RATE
from mitex.methods.geometric.coarse_relief import FINE, TURNS, WIDE, CoarseRelief

BALL = icosphere(16)
split = cache(coarse_relief.split)  # of the meshes below, which are made once
EDGE = float(BALL.edge_lengths.mean())
TORUS = torus(64, 28, tube=0.45)


@pytest.fixture(autouse=True)
def few_patches(monkeypatch):
    """Which take seconds."""
    monkeypatch.setattr("mitex.methods.geometric.coarse_patches.PLACES", 50)


def with_heights(heights: np.ndarray) -> Mesh:
    return BALL.with_vertices(BALL.vertices * (1 + EDGE * heights[:, None]))


def middles(count: int) -> np.ndarray:
    """Points evenly spread on the ball."""
    k = np.arange(count)
    angle, y = np.pi * (3 - 5**0.5) * k, 1 - 2 * (k + 0.5) / count
    ring = np.sqrt(1 - y * y)
    return np.stack([ring * np.sin(angle), y, ring * np.cos(angle)], 1)


@cache
def bumps(side: float, count: int = 40, width: float = 3.0) -> Mesh:
    """Round ones around points that are evenly spread, one edge high and so many wide."""
    away, _ = KDTree(middles(count)).query(BALL.vertices)
    return with_heights(side * np.exp(-((away / (0.5 * width * EDGE)) ** 2)))


@cache
def waves(length: float, count: int = 80) -> Mesh:
    """Waves so many edges long, of random directions."""
    rng = np.random.default_rng(1)
    ways = 2 * np.pi / (length * EDGE) * unit(rng.normal(size=(count, 3)))
    phases = rng.uniform(0, 2 * np.pi, count)
    return with_heights(np.cos(BALL.vertices @ ways.T + phases).sum(1) / np.sqrt(0.5 * count))


@cache
def stripes(length: float) -> Mesh:
    """Circles of latitude, so many edges from one to the next."""
    return with_heights(np.cos(2 * np.pi / (length * EDGE) * np.arcsin(np.clip(BALL.vertices[:, 1], -1, 1))))


def laid(coarse: CoarseRelief, mesh: Mesh, seed: int = 0) -> np.ndarray:
    """Heights of what is laid on a mesh [mean edges]."""
    moves = coarse.on(mesh)(seed) - mesh.vertices
    return (moves * mesh.normals).sum(1) / mesh.edge_lengths.mean()


def test_other_reliefs_and_those_along_a_field_have_no_bumps():
    dents = split(bumps(-1))
    field = vector_field(dents.base, "up")
    assert len(dents.bumps) == 40 and len(CoarseRelief(dents.base, dents.heights, field).bumps) == 0
    assert len(split(waves(8)).bumps) == 0


def test_bumps_are_found_in_their_middles():
    relief = split(bumps(1))
    away, _ = KDTree(middles(40)).query(unit(relief.base.vertices[relief.bumps].astype(float)))
    assert away.max() < 1.2 * EDGE


def islands(mesh: Mesh, heights: np.ndarray) -> int:
    """How many parts of a mesh are higher than half of the highest hundredth."""
    high = heights > 0.5 * np.quantile(heights, 0.99)
    i, j = mesh.edges.rows, mesh.edges.indices
    both = high[i] & high[j]
    graph = coo_array((np.ones(both.sum()), (i[both], j[both])), shape=(len(high),) * 2)
    label = connected_components(graph, directed=False)[1]
    return len(np.unique(label[high]))


def test_a_ball_has_no_relief():
    coarse = split(BALL)
    assert np.allclose(coarse.base.vertices, BALL.vertices, atol=2e-3)
    assert np.abs(coarse.heights).max() < 0.05 * EDGE


@pytest.mark.parametrize("side", [1, -1])
def test_the_relief_is_taken_off(side):
    coarse = split(bumps(side))
    assert np.linalg.norm(coarse.base.vertices, axis=1).std() < 0.1 * EDGE
    assert 0.05 < coarse.heights.std() / EDGE < 0.5 and abs(coarse.heights.mean()) < 1e-6
    assert np.sign(np.mean(coarse.heights**3)) == side
    assert np.allclose(np.cross(coarse.displacements, coarse.base.normals), 0, atol=1e-6)
    assert np.allclose((coarse.displacements * coarse.base.normals).sum(1), coarse.heights, atol=1e-6)


def spread(length: float) -> float:
    mesh = waves(length)
    return float(split(mesh).heights.std() / mesh.edge_lengths.mean())


def test_only_the_band_between_both_filters_counts():
    """Waves in it, half as long as the fine filter keeps, and much longer than the wide one lets by."""
    middle, short, long = map(spread, (7, 2.2 * FINE, 12 * WIDE))
    assert middle > 1.9 * short and middle > 9 * long


@pytest.mark.parametrize("mesh", [BALL, TORUS], ids=["ball", "torus"])
@pytest.mark.parametrize("side", [1, -1])
def test_bumps_and_dents_are_as_many_on_an_area(side, mesh):
    coarse = split(bumps(side))
    assert len(coarse.bumps) == 40
    heights = laid(coarse, mesh)
    assert (
        heights.std() == pytest.approx(coarse.heights.std() / EDGE, rel=0.02) and abs(heights.mean()) < 1e-3
    )
    own, others = islands(coarse.base, side * coarse.heights), islands(mesh, side * heights)
    assert len(mesh.faces) / others == pytest.approx(len(BALL.faces) / own, rel=0.15)


@pytest.mark.parametrize("side", [1, -1])
def test_bumps_have_the_profile_of_the_references(side):
    """As high in the middle, and as wide at half of that."""
    coarse = split(bumps(side, width=4))
    own, other = side * coarse.heights / EDGE, side * laid(coarse, TORUS)
    ground = [np.median(heights) for heights in (own, other)]
    top = [np.quantile(h, 0.99) - g for h, g in zip((own, other), ground, strict=True)]
    assert top[1] == pytest.approx(top[0], rel=0.15)
    share = [(h - g > 0.5 * top[0]).mean() for h, g in zip((own, other), ground, strict=True)]
    assert share[1] == pytest.approx(share[0], rel=0.2)


def test_bumps_that_lie_far_apart_are_taken_off():
    """Which are wider than what else counts as relief."""
    high = bumps(1, count=12, width=9)
    meshes = split(high).base, blurred(high, WIDE * EDGE), high
    taken, still, before = (np.linalg.norm(mesh.vertices, axis=1).std() for mesh in meshes)
    assert taken < 0.25 * before and taken < 0.5 * still


def test_a_bump_does_not_show_on_the_other_side_of_a_wall():
    wall = BALL.with_vertices(BALL.vertices * np.array([1, 1, 0.02]))
    heights = laid(split(bumps(1)), wall)
    _, behind = KDTree(BALL.vertices).query(BALL.vertices * np.array([1, 1, -1]))
    inner = np.linalg.norm(BALL.vertices[:, :2], axis=1) < 0.8
    assert np.corrcoef(heights[inner], heights[behind][inner])[0, 1] < 0.3


def test_parts_without_a_bump_are_ground():
    """Sixty small balls have faces enough for nine bumps."""
    small = icosphere(1)
    shifts = 3.0 * np.arange(60)[:, None]
    points = (small.vertices + (shifts * np.array([1, 0, 0]))[:, None]).reshape(-1, 3)
    faces = (small.faces + len(small.vertices) * np.arange(60)[:, None, None]).reshape(-1, 3)
    balls = Mesh(points.astype(np.float32), faces.astype(np.int32), name="balls")
    highest = laid(split(bumps(1)), balls).reshape(60, -1).max(1)
    assert (highest > np.median(highest) + 0.01).sum() == 9


def slopes(mesh: Mesh, heights: np.ndarray) -> np.ndarray:
    """(F, 3) gradients of what vertices have."""
    crosses = np.asarray(mesh.face_crosses, float)
    points = mesh.vertices[mesh.faces].astype(float)
    sides = np.roll(points, 1, axis=1) - np.roll(points, -1, axis=1)
    turned = np.cross(crosses[:, None], sides) / (crosses**2).sum(1)[:, None, None]
    return (turned * heights[mesh.faces][..., None]).sum(1)


def test_stripes_run_on():
    """Along the steepest slope they rise and fall, across it hardly; random waves do both."""
    shares = []
    middles = TORUS.vertices[TORUS.faces].mean(1)
    _, near = KDTree(middles).query(middles, k=60)
    for mesh in (stripes(8), waves(8)):
        around = slopes(TORUS, laid(split(mesh), TORUS))[near]
        values = np.linalg.eigvalsh(around.swapaxes(1, 2) @ around)
        shares.append((values[:, 2] / values.sum(1)).mean())
    assert shares[0] > 0.8 and shares[0] > shares[1] + 0.1


@cache
def along_up(symmetric: bool) -> CoarseRelief:
    """The relief of circles of latitude, which follow `up`."""
    whole = split(stripes(8))
    return CoarseRelief(whole.base, whole.heights, vector_field(whole.base, "up"), symmetric)


@pytest.mark.parametrize("name", ["about-y", "up"])
def test_a_relief_follows_its_field(name):
    """Of the slopes of circles of latitude, which follow `up`, most are along the field that is given."""
    coarse = along_up(symmetric=True)
    field = vector_field(TORUS, name)
    heights = ((coarse.on(TORUS, field)(0) - TORUS.vertices) * TORUS.normals).sum(1)
    steep = slopes(TORUS, heights)
    there = np.linalg.norm(field, axis=1)[TORUS.faces].min(1) > 0.5
    ahead = unit(field[TORUS.faces].mean(1).astype(float))
    along = np.square((steep * ahead).sum(1))[there].sum()

    assert along / np.square(steep)[there].sum() > 0.8


def test_patches_lie_both_ways_if_ends_look_alike():
    one, both = (along_up(symmetric).patches for symmetric in (False, True))
    assert len(both.values) == 2 * len(one.values)


def test_seeds_and_edges_decide_what_is_laid():
    """Other seeds give others; on a mesh four times as large, all is four times as large."""
    coarse = split(waves(8))
    lay = coarse.on(BALL)
    assert np.array_equal(lay(0), lay(0)) and not np.allclose(lay(0), lay(1))
    large = BALL.with_vertices(4 * BALL.vertices)  # whose choices rounding does not change
    assert np.allclose(coarse.on(large)(2), 4 * lay(2), atol=1e-4)
    assert coarse.patches.length == PATCH * RATE


def test_patches_are_smaller_on_a_small_reference():
    small = icosphere(6)
    assert 8 <= CoarseRelief(small, np.zeros(len(small.vertices))).patches.length < PATCH * RATE


def test_a_reference_without_room_for_a_patch_is_refused():
    tiny = icosphere(1)
    with pytest.raises(ConfigError, match="no square 4 edges wide lies flat on .*; begin on a higher level"):
        _ = CoarseRelief(tiny, np.zeros(len(tiny.vertices))).patches


class TestKeptPatches:
    @pytest.fixture(autouse=True)
    def own_cache(self, tmp_path, monkeypatch):
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def test_they_are_taken_once(self, monkeypatch):
        """Another process finds them in the cache, and lays the same."""
        coarse = replace(split(waves(8)), kept=True)
        first = coarse.on(BALL)(0)
        computed = coarse_patches.height_patches(coarse.base, coarse.heights, None, TURNS)
        monkeypatch.setattr(coarse_patches, "height_patches", lambda *_: pytest.fail("taken again"))
        again = replace(coarse)
        np.testing.assert_array_equal(again.patches.values, computed.values)
        np.testing.assert_array_equal(again.patches.centres, computed.centres)
        assert again.patches.length == computed.length
        np.testing.assert_array_equal(again.on(BALL)(0), first)

    def test_those_of_other_reliefs_are_others(self):
        coarse = replace(split(waves(8)), kept=True)
        other = replace(coarse, heights=-coarse.heights)
        along = replace(along_up(False), kept=True)
        both = replace(along, symmetric=True)
        for one, two in ((coarse, other), (along, both)):
            assert not np.array_equal(one.patches.values, two.patches.values)

    def test_those_of_a_training_are_not_kept(self, tmp_path):
        assert len(split(waves(8)).patches.values) and not list(tmp_path.iterdir())
