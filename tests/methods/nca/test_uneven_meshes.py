"""Bundled looks on meshes unlike the sphere of their training: no colours that the exemplar does not have."""

from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest
import torch
from scipy.spatial import ConvexHull

from mitex.mesh import Mesh, icosphere, scattered_sphere, subdivide_midpoint, torus
from mitex.methods.nca import METHOD, NcaTexture, bake
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.surface import Surface
from mitex.methods.nca.healing import inner
from mitex.methods.nca.palette import Palette
from mitex.methods.registry import bundled

STEPS = 100
GROUPS = [list(range(start, 30, 8)) for start in range(8)]  # of meshes that a look grows on at once
surface = cache(Surface)  # of a mesh, for all looks
LOOKS = [name for name in bundled(METHOD) if "palette" in NcaTexture.load(name).about]


def stretched(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    return mesh.with_vertices(mesh.vertices * rng.uniform(0.3, 3.0, 3))


def jittered(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    edge = np.linalg.norm(mesh.vertices[mesh.edges.indices] - mesh.vertices[mesh.edges.rows], axis=1).mean()
    return mesh.with_vertices(mesh.vertices + rng.normal(0, 0.2 * edge, mesh.vertices.shape))


def coarse(rng: np.random.Generator) -> Mesh:
    """A hull of few points, finely subdivided: large and small triangles, slivers, high valences."""
    points = rng.normal(size=(int(rng.integers(5, 40)), 3))
    hull = ConvexHull(points)
    used, faces = np.unique(hull.simplices, return_inverse=True)
    mesh = Mesh(points[used].astype(np.float32), faces.reshape(-1, 3), name="hull")
    return subdivide_midpoint(mesh, int(np.ceil(np.log(600 / len(used)) / np.log(4))))


def fan(spokes: int, rng: np.random.Generator) -> Mesh:
    """Two vertices of any valence, joined by a band of triangles."""
    angle = np.arange(spokes) * 2 * np.pi / spokes
    ring = np.stack([np.cos(angle), np.zeros(spokes), np.sin(angle)], 1)
    points = np.concatenate([ring, [[0, 1, 0], [0, -1, 0]]]).astype(np.float32)
    k = np.arange(spokes)
    top = np.stack([k, np.full(spokes, spokes), (k + 1) % spokes], 1)
    bottom = np.stack([(k + 1) % spokes, np.full(spokes, spokes + 1), k], 1)
    return jittered(
        subdivide_midpoint(Mesh(points, np.concatenate([top, bottom])), 4 if spokes < 10 else 3), rng
    )


@cache
def meshes() -> list[Mesh]:
    rng = np.random.default_rng(0)
    smooth = [icosphere(11), torus(36, 32), scattered_sphere(1200, 1), scattered_sphere(1200, 2)]
    every = [stretched(mesh, rng) for mesh in smooth] + [jittered(mesh, rng) for mesh in smooth]
    every += [jittered(stretched(mesh, rng), rng) for mesh in smooth]
    every += [coarse(rng) for _ in range(12)]
    return every + [fan(spokes, rng) for spokes in (3, 4, 5, 8, 15, 30)]


@cache
def joined() -> list[tuple[list[int], Mesh]]:
    """Numbers of a few meshes, and one mesh of them: on it a look grows on all of them, in less time."""
    return [(numbers, union([meshes()[number] for number in numbers])) for numbers in GROUPS]


def union(parts: list[Mesh]) -> Mesh:
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in parts)])
    faces = [mesh.faces + start for mesh, start in zip(parts, first, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in parts]), np.concatenate(faces))


def grown(texture: NcaTexture) -> Iterator[tuple[int, torch.Tensor]]:
    """The number of each mesh, and the state on it."""
    for seed, (numbers, mesh) in enumerate(joined()):
        counts = [len(meshes()[number].vertices) for number in numbers]
        yield from zip(numbers, texture.grow(mesh, steps=STEPS, seed=seed).split(counts), strict=True)


@pytest.mark.parametrize("name", LOOKS)
def test_no_region_has_foreign_colours(name, monkeypatch):
    """Not even before colours are held within the exemplar's; after it, no vertex has."""
    monkeypatch.setattr(bake, "Surface", surface)
    texture = NcaTexture.load(name)
    palette = Palette.from_record(texture.about["palette"])
    for number, state in grown(texture):
        mesh = meshes()[number]
        colours = GrownTexture(texture.look, state, Cells(mesh, 0, mesh)).at_vertices()["albedo"]
        assert not inner(mesh, palette.unlike(colours)).any(), f"mesh {number}, {mesh}"
        assert not palette.unlike(palette.project(colours)).any(), f"mesh {number}, {mesh}"


def test_there_are_thirty_meshes_of_all_valences():
    valences = np.concatenate([np.diff(mesh.edges.indptr) for mesh in meshes()])
    assert sorted(sum(GROUPS, [])) == list(range(len(meshes())))
    assert len(meshes()) == 30 and valences.min() == 3 and valences.max() >= 30
