"""Patches joined on a surface: strands go on across the borders of charts, wherever these are cut."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mitex.atlas import unwrap
from mitex.errors import ConfigError
from mitex.evaluation.seams import ratio_across
from mitex.geometry.triangles import interpolate
from mitex.images import bilinear
from mitex.mesh import Mesh, grid, icosphere
from mitex.quilting.guide import SurfaceGuide
from mitex.quilting.matching import ArraySource
from mitex.quilting.plane import Quilt
from mitex.quilting.surface import quilt_on
from mitex.quilting.target import SurfaceTarget
from tests.quilting.tubes import joined, tube

PATCH, PERIOD = 32, 16.0  # [texels]
GAP = 0.05  # between texels of patches, on meshes of size 2
SIDE = 160  # of maps


def strands(count: int = 200, along: int = 0, seed: int = 0) -> ArraySource:
    """Patches with strands from left to right (or from top to bottom), anywhere between two strands."""
    rng = np.random.default_rng(seed)
    row = np.arange(PATCH)[:, None] + np.zeros(PATCH)
    shift = rng.uniform(0, PERIOD, (count, 1, 1))
    wave = 2 * np.pi * ((row.T if along else row) + shift) / PERIOD
    places = rng.uniform(0, 100, (count, 2))
    return ArraySource(np.stack([np.sin(wave), np.cos(wave)], -1).astype(np.float32), places, 1.0)


def on(mesh: Mesh, source: ArraySource | None = None, side: int = SIDE, seed: int = 0) -> tuple[Mesh, Quilt]:
    """The mesh with charts, unless it has them, and what was quilted on it."""
    if mesh.uv is None:
        mesh = replace(mesh, uv=unwrap(mesh, side, 3))
    target = SurfaceTarget(mesh, side, PATCH, GAP)
    return mesh, quilt_on(source or strands(), target, np.random.default_rng(seed))


@cache
def on_a_ball() -> tuple[Mesh, Quilt]:
    return on(icosphere(10))


def seen(mesh: Mesh, quilt: Quilt, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """(P, C) at points of the mesh."""
    assert mesh.uv is not None
    return bilinear(quilt.features, interpolate(barycentric, np.asarray(mesh.uv)[face]))


def seams(mesh: Mesh, quilt: Quilt) -> float:
    assert mesh.uv is not None
    return ratio_across(mesh, np.asarray(mesh.uv), lambda f, b: seen(mesh, quilt, f, b), GAP / 2)


def points(mesh: Mesh, count: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Faces, barycentrics and places of random points."""
    rng = np.random.default_rng(1)
    face = rng.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    barycentric = rng.dirichlet([1.0] * 3, count)
    return face, barycentric, interpolate(barycentric, mesh.vertices[mesh.faces[face]])


def striped(values: np.ndarray, along: np.ndarray) -> float:
    """How nearly values (P, 2) are one strand's sine and cosine of places (P,) [periods]: 1 if they are."""
    phase = (values[:, 1] + 1j * values[:, 0]) * np.exp(-2j * np.pi * along)
    return float(max(np.abs(phase.mean()), np.abs((phase.conj() * np.exp(-4j * np.pi * along)).mean())))


CUTS = {"xatlas": None, "one seam": "strip", "every face": "faces"}


def charts(mesh: Mesh, kind: str | None) -> Mesh:
    """A tube, cut as it is asked for."""
    if kind is None:
        return replace(mesh, uv=unwrap(mesh, SIDE, 3))
    if kind == "faces":  # each on its own, in a lattice
        columns = int(np.ceil(np.sqrt(len(mesh.faces))))
        corner = np.array([[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]])
        place = np.stack(np.divmod(np.arange(len(mesh.faces)), columns), 1)
        return replace(mesh, uv=(place[:, None] + corner).astype(np.float32) / columns)
    corners = mesh.vertices[mesh.faces]
    angle = np.arctan2(corners[..., 0], corners[..., 2])
    angle = np.where(np.ptp(angle, axis=1, keepdims=True) > np.pi, np.mod(angle, 2 * np.pi), angle)
    around = (angle + np.pi) / (2 * np.pi)
    uv = np.stack([0.05 + 0.88 * around, 0.5 + 0.25 * corners[..., 1]], 2)
    return replace(mesh, uv=uv.astype(np.float32))


@pytest.mark.parametrize("along", [0, 1], ids=["around", "upright"])
@pytest.mark.parametrize("cut", ["xatlas", "one seam"])
def test_strands_go_on_across_charts(cut: str, along: int):
    """On a tube whose girth is a whole number of periods."""
    radius = 10 * PERIOD * GAP / (2 * np.pi)
    mesh = charts(tube(radius, 2.0, around=40, rows=12)[0], CUTS[cut])
    mesh, quilt = on(mesh, strands(along=along), 2 * SIDE)
    face, barycentric, _ = points(mesh)

    def along_strands(face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        place = interpolate(barycentric, mesh.vertices[mesh.faces[face]])
        turn = radius * np.arctan2(place[:, 0], place[:, 2])
        return (turn if along else place[:, 1]) / (PERIOD * GAP)

    def exact(face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        wave = 2 * np.pi * along_strands(face, barycentric)
        return np.stack([np.sin(wave), np.cos(wave)], 1)

    assert striped(seen(mesh, quilt, face, barycentric), along_strands(face, barycentric)) > 0.9
    assert seams(mesh, quilt) < 1.3 * ratio_across(mesh, np.asarray(mesh.uv), exact, GAP / 2)


def test_a_texture_laid_over_the_uvs_breaks():
    """What the measure says of the published way, and what it does not say of the surface's."""
    mesh, quilt = on_a_ball()
    rows = 2 * np.pi * np.arange(SIDE)[:, None] / PERIOD + np.zeros(SIDE)
    flat = replace(quilt, features=np.stack([np.sin(rows), np.cos(rows)], -1).astype(np.float32))
    assert seams(mesh, flat) > 3.0
    assert seams(mesh, quilt) < 1.5


def test_all_of_the_surface_is_covered_by_whole_patches():
    mesh, quilt = on_a_ball()
    face, barycentric, _ = points(mesh)
    length = np.linalg.norm(seen(mesh, quilt, face, barycentric), axis=1)
    assert (length > 0.4).mean() > 0.99 and np.median(length) > 0.95
    used = np.abs(quilt.features).sum(-1) > 0
    least = mesh.face_areas.sum() / (PATCH * GAP) ** 2  # patches side by side
    assert least < len(np.unique(quilt.patch[used])) < 3 * least and not quilt.flip.any()
    source = strands()
    np.testing.assert_array_less(np.abs(quilt.features), 1 + 1e-5)
    shown = quilt.look_up(source.values)[used]
    # Away from seams, a texel is what its patch has there.
    assert np.median(np.linalg.norm(shown - quilt.features[used], axis=1)) < 0.3


def test_patches_have_their_size():
    """The period on the mesh is that of the patches, whatever the size of the map."""
    for side in (SIDE, SIDE // 2):
        mesh, quilt = on(replace(grid(6, 6), uv=None), strands(), side)
        face, barycentric, place = points(mesh)
        assert striped(seen(mesh, quilt, face, barycentric), place[:, 1] / (PERIOD * GAP)) > 0.9


@pytest.mark.parametrize("name", ["one face", "two parts", "sheets", "faces of their own"])
def test_hard_meshes(name: str):
    flat = replace(grid(4, 4), uv=None)
    mesh = {
        "one face": Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]]), name="one"),
        "two parts": joined(flat, flat.with_vertices(flat.vertices + [0, 0, 1.0])),
        "sheets": joined(flat, flat.with_vertices(flat.vertices[:, [0, 2, 1]])),
        "faces of their own": charts(tube(0.8, 2.0, around=12, rows=6)[0], "faces"),
    }[name]
    mesh, quilt = on(mesh)
    face, barycentric, _ = points(mesh, 1000)
    assert (np.linalg.norm(seen(mesh, quilt, face, barycentric), axis=1) > 0.3).mean() > 0.95


def test_patches_larger_than_the_mesh(monkeypatch):
    """They cover what they can of it, not one face at a time."""
    mesh = icosphere(6)
    target = SurfaceTarget(replace(mesh, uv=unwrap(mesh, 64, 3)), 64, PATCH, 4 / PATCH)
    places = []
    around = SurfaceTarget.around
    monkeypatch.setattr(
        SurfaceTarget, "around", lambda self, texel: places.append(texel) or around(self, texel)
    )
    quilt_on(strands(), target, np.random.default_rng(0))
    assert len(places) < 100 < len(target.mesh.faces) / 10


def test_seeds():
    mesh = replace(grid(4, 4), uv=None)
    first, again, other = (on(mesh, seed=seed)[1] for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.patch, again.patch)
    np.testing.assert_array_equal(first.features, again.features)
    assert (first.patch != other.patch).any()


def test_evenness_shows_what_is_rare():
    """Of patches alike, one is used again and again unless that costs."""
    counts = []
    for evenness in (0.0, 2.0):
        mesh = icosphere(6)
        target = SurfaceTarget(replace(mesh, uv=unwrap(mesh, SIDE, 3)), SIDE, PATCH, 0.6 * GAP)
        quilt = quilt_on(strands(40), target, np.random.default_rng(0), nearest=2, evenness=evenness)
        counts.append(len(np.unique(quilt.patch)))
    assert counts[1] > counts[0] + 2


def test_refusals():
    target = SurfaceTarget(replace(grid(2, 2)), 16, PATCH, GAP)
    with pytest.raises(ConfigError, match="candidates"):
        quilt_on(strands(), target, np.random.default_rng(0), nearest=0)
    with pytest.raises(ConfigError, match="evenness"):
        quilt_on(strands(), target, np.random.default_rng(0), evenness=-1.0)


def levels(count: int = 40) -> ArraySource:
    """Plain patches, from 0 to 1."""
    value = np.linspace(0, 1, count, dtype=np.float32)[:, None, None, None]
    return ArraySource(
        np.broadcast_to(value, (count, PATCH, PATCH, 1)).copy(),
        np.arange(2 * count).reshape(-1, 2) * 100.0,
        1.0,
    )


def shades(source: ArraySource) -> np.ndarray:
    """(P, 2, 2, 3) colours of plain patches."""
    return np.broadcast_to(source.values.mean((1, 2))[:, None, None], (len(source.values), 2, 2, 3))


@pytest.mark.parametrize("weight", [0.0, 20.0])
def test_a_guide_decides_what_is_where(weight):
    """Bright above and dark below, across all charts of a ball."""
    ball, source, side = icosphere(8), levels(), SIDE
    mesh = replace(ball.with_vertices(2 * ball.vertices), uv=unwrap(ball, side, 3))
    target = SurfaceTarget(mesh, side, PATCH, GAP)
    corners = target.mesh.vertices[target.mesh.faces[target.texels.face]]
    height = interpolate(target.texels.barycentric, corners)[:, 1]
    wanted = np.repeat((height > 0)[:, None], 3, axis=1).astype(np.float32)
    guide = SurfaceGuide(wanted, shades(source), PATCH, weight)
    quilt = quilt_on(source, target, np.random.default_rng(0), guide=guide)
    values = quilt.features[..., 0].ravel()[target.texels.index]
    clear = np.abs(height) > 0.5 * PATCH * GAP
    likeness = np.corrcoef(values[clear], height[clear] > 0)[0, 1]
    assert likeness > 0.9 if weight else abs(likeness) < 0.5


def test_blocks_of_a_guide_by_hand():
    """Those without texels do not count."""
    colours = np.random.default_rng(0).random((3, 2, 2, 3)).astype(np.float32)
    texels = np.random.default_rng(1).random((5, 3)).astype(np.float32)
    guide = SurfaceGuide(texels, colours, 8, weight=2.0)
    where = np.array(
        [[0.0, 1.0], [3.4, 0.2], [5.0, 2.0], [7.4, 7.0]]
    )  # two in the first block, one in two more
    chosen = np.array([0, 2, 3, 4])
    means = [texels[[0, 2]].mean(0), texels[3], texels[4]]
    for k, one in enumerate(colours):
        blocks = [one[0, 0], one[0, 1], one[1, 1]]
        squares = [np.square(b - m).mean() for b, m in zip(blocks, means, strict=True)]
        assert guide.differences(chosen, where)[k] == pytest.approx(2 * np.sqrt(np.mean(squares)), rel=1e-5)


def test_guides_of_other_patches_are_refused():
    source = levels()
    target = SurfaceTarget(replace(icosphere(3), uv=unwrap(icosphere(3), SIDE, 3)), SIDE, PATCH, GAP)
    guide = SurfaceGuide(np.zeros((target.count, 3)), shades(source)[:7], PATCH)
    with pytest.raises(ConfigError, match="a guide of 7 patches for 40"):
        quilt_on(source, target, np.random.default_rng(0), guide=guide)
    with pytest.raises(ConfigError, match="divides 32"):
        SurfaceGuide(np.zeros((4, 3)), np.zeros((2, 5, 5, 3)), PATCH)
