"""xatlas in a process of its own: the same charts, and an error where it crashes."""

import sys

import numpy as np
import pytest
import xatlas

from mitex.charts import Packing, packed_charts
from mitex.errors import MeshError
from mitex.mesh import icosphere, torus

# An xatlas whose thread waits forever.
SLEEPY = """
from threading import Event, Thread
from types import SimpleNamespace
import numpy as np

class Atlas:
    width = height = 64
    def add_mesh(self, vertices, faces): Thread(target=Event().wait).start()
    def generate(self, chart, pack): pass
    def get_mesh(self, k): return None, np.array([[0, 1, 2]]), np.array([[0, 0], [1, 0], [0, 1]], np.float32)

ChartOptions = PackOptions = SimpleNamespace
"""


def directly(parts, packing):
    """What xatlas makes of it in this process."""
    atlas = xatlas.Atlas()
    for vertices, faces in parts:
        atlas.add_mesh(vertices, faces.astype(np.uint32))
    chart, pack = xatlas.ChartOptions(), xatlas.PackOptions()
    chart.max_chart_area = packing.largest
    pack.resolution, pack.padding, pack.bilinear = packing.resolution, packing.padding, True
    atlas.generate(chart, pack)
    size = np.array([atlas.width, atlas.height])
    corners = [uv[faces.astype(int)] for _, faces, uv in map(atlas.get_mesh, range(len(parts)))]
    return [uv * size / size.max() for uv in corners]


@pytest.mark.parametrize("packing", [Packing(128, 2), Packing(256, 2), Packing(128, 9), Packing(128, 2, 0.5)])
def test_charts_are_those_of_xatlas(packing):
    parts = [(mesh.vertices, mesh.faces) for mesh in (torus(24, 16), icosphere(4))]
    result = packed_charts(parts, packing, "two")
    for corners, expected in zip(result, directly(parts, packing), strict=True):
        assert corners.dtype == np.float32
        np.testing.assert_allclose(corners, expected, atol=1e-6)


def test_a_mesh_that_crashes_xatlas_is_an_error():
    """It exhausts the stack on fine spheres (its issue 146)."""
    sphere = icosphere(66)
    with pytest.raises(MeshError, match=r"ball cannot be unwrapped: xatlas failed \(code -\d+\)"):
        packed_charts([(sphere.vertices, sphere.faces)], Packing(512, 2), "ball")


def test_what_the_process_says_last_is_told():
    with pytest.raises(MeshError, match=r"xatlas failed \(.*[a-z].*\)"):
        packed_charts([(np.zeros((3, 3)), np.array([[0, 1, 7]]))], Packing(64, 2), "broken")


def test_nobody_waits_for_threads_of_xatlas_that_never_end(monkeypatch, tmp_path):
    (tmp_path / "xatlas.py").write_text(SLEEPY)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    (corners,) = packed_charts([(np.eye(3), np.array([[0, 1, 2]]))], Packing(64, 2), "triangle")
    np.testing.assert_array_equal(corners, [[[0, 0], [1, 0], [0, 1]]])
