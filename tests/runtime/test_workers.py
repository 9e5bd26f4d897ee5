"""How many threads k-d trees get: as many as the user allows, and none for a few points."""

import threading

import numpy as np
import pytest
import torch

import mitex.runtime
from mitex.losses.chamfer import Samples, chamfer
from mitex.mesh import icosphere
from mitex.mesh.nearest import surface_points
from mitex.methods.nerf.field.nearest import NearestVertices
from mitex.runtime import workers
from mitex.runtime.workers import MANY, allowed, tree_threads

SPHERE = icosphere(8)


@pytest.fixture(autouse=True)
def unset(monkeypatch):
    monkeypatch.delenv("MITEX_THREADS", raising=False)
    monkeypatch.setattr(workers, "_threads", None)


def test_the_program_goes_before_the_environment(monkeypatch):
    assert allowed() is None and tree_threads(MANY) == -1
    monkeypatch.setenv("MITEX_THREADS", "3")
    assert allowed() == tree_threads(MANY) == 3
    mitex.runtime.threads(1)
    assert allowed() == tree_threads(MANY) == 1


def test_few_points_get_one():
    assert tree_threads(MANY - 1) == 1


def nearest_on_the_mesh(points):
    surface_points(SPHERE, points)


def nearest_samples(points):
    samples = Samples(torch.from_numpy(points), torch.from_numpy(points))
    chamfer(samples, samples)


def nearest_vertices(points):
    NearestVertices(SPHERE.vertices, 4, 1e-4)(points.astype(np.float32))


@pytest.mark.parametrize("ask", [nearest_on_the_mesh, nearest_samples, nearest_vertices])
def test_trees_keep_to_it(ask, mi, monkeypatch):
    """By the threads that start."""
    starts = []
    start = threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", lambda thread: (starts.append(thread), start(thread)))
    points = np.random.default_rng(0).normal(size=(MANY, 3))
    for count in (1, 3):
        monkeypatch.setenv("MITEX_THREADS", str(count))
        starts.clear()
        ask(points)
        assert len(starts) % count == 0 and bool(starts) == (count > 1)
