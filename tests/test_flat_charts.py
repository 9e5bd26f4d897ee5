"""Charts of very large meshes: parts of the surface, seen along an axis, that cover no texel twice."""

from functools import cache

import numpy as np
import pytest

from mitex import flat_charts
from mitex.atlas import unwrap, usable_uv
from mitex.charts import Packing
from mitex.flat_charts import projected_charts
from mitex.geometry.triangles import twice_area
from mitex.mesh import Mesh, embedded, icosphere

TURNS, AROUND = 3, 24


PACKING = Packing(512, 4)


def ramp(turns: int = TURNS, around: int = AROUND) -> Mesh:
    """A spiral ramp, whose turns lie above each other."""
    angle = np.arange(turns * around + 1) * 2 * np.pi / around
    rings = [
        np.stack((radius * np.cos(angle), 0.05 * angle, radius * np.sin(angle)), axis=1)
        for radius in (0.5, 1.0)
    ]
    inner = np.arange(len(angle) - 1)
    outer = inner + len(angle)
    faces = np.concatenate(
        (np.stack((inner, outer + 1, outer), axis=1), np.stack((inner, inner + 1, outer + 1), axis=1))
    )
    return Mesh(np.concatenate(rings).astype(np.float32), faces.astype(np.int32), name="ramp")


def folded() -> Mesh:
    """Two squares of two triangles that share an edge and lie on each other."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0], [1, 1, 0]], np.float32)
    return Mesh(vertices, np.array([[0, 1, 2], [1, 3, 2], [0, 4, 2], [4, 5, 2]]), name="folded")


MESHES = {mesh.name: mesh for mesh in (icosphere(12), embedded("shaderball"), ramp(), folded())}


@cache
def charts_of(name: str) -> tuple[np.ndarray, np.ndarray]:
    return projected_charts(MESHES[name], PACKING)


@pytest.mark.parametrize("name", MESHES)
def test_no_texel_is_covered_twice_and_no_face_is_missing(name):
    mesh, (uv, _) = MESHES[name], charts_of(name)
    assert usable_uv(mesh, uv)
    seen = np.abs(twice_area(uv))
    whole = mesh.face_areas > 1e-6 * mesh.face_areas.mean()
    assert (seen[whole] > 0).all()


def test_faces_are_shown_in_proportion_to_how_much_they_look_along_their_axis():
    mesh, (uv, charts) = MESHES["icosphere12"], charts_of("icosphere12")
    assert charts.max() == 5
    cosines = np.abs(mesh.face_normals).max(1)
    scale = 0.5 * np.abs(twice_area(uv)) / (mesh.face_areas * cosines)
    inner = cosines > 0.75  # others may be counted to the side of their neighbours
    np.testing.assert_allclose(scale[inner], np.median(scale), rtol=1e-2)  # sides of charts are whole texels


def test_turns_of_a_spiral_are_cut_apart():
    _, charts = charts_of("ramp")
    assert charts.max() + 1 >= TURNS


def test_charts_are_cut_until_none_overlaps(monkeypatch):
    """Forty turns, which takes six rounds of cuts; on a coarse raster, which takes less time."""
    monkeypatch.setattr(flat_charts, "GRID", 256)
    mesh = ramp(40, 6)
    assert usable_uv(mesh, projected_charts(mesh, PACKING)[0])


def test_a_face_that_looks_away_from_its_neighbours_has_a_chart_of_its_own():
    flat = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0), [0.0], indexing="ij"), -1).reshape(-1, 3)
    corner = (6 * np.arange(5)[:, None] + np.arange(5)).ravel()
    faces = np.concatenate(
        (np.stack((corner, corner + 6, corner + 7), 1), np.stack((corner, corner + 7, corner + 1), 1))
    )
    flat[14, 2] = 8.0  # a spike of six steep faces
    mesh = Mesh(flat.astype(np.float32), faces.astype(np.int32), name="spike")
    uv, charts = projected_charts(mesh, PACKING)
    steep = (mesh.faces == 14).any(1)
    assert len(set(charts[~steep]) & set(charts[steep])) == 0
    assert usable_uv(mesh, uv)


def test_unwrap_projects_meshes_above_its_limit(monkeypatch):
    monkeypatch.setattr("mitex.atlas.HUGE", 1000)
    calls = []
    monkeypatch.setattr(
        "mitex.atlas.projected_charts",
        lambda *args: calls.append(args) or flat_charts.projected_charts(*args),
    )
    mesh = icosphere(12)
    assert usable_uv(mesh, unwrap(mesh, 256, 4)) and len(calls) == 1
    unwrap(icosphere(3), 256, 4)
    assert len(calls) == 1
