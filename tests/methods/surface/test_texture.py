"""Texture files that do not fit together."""

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

from mitex.errors import CheckpointError
from mitex.mesh import Mesh, grid
from mitex.mesh.polygons import Polygons
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.texture import SurfaceTexture

ABOUT = {"resolution": 16, "frames": "fixed", "angle": 0.0}


def _saved(path, maps, channels):
    domain = SurfaceDomain(grid(2, 2), 16, "fixed")
    values = np.zeros((len(domain.texels.index), channels), np.float32)
    return SurfaceTexture(domain, values, maps, ABOUT).save(path)


def test_maps_and_channels_that_agree(tmp_path):
    loaded = SurfaceTexture.load(_saved(tmp_path / "a.safetensors", ("albedo", "height"), 4))
    assert loaded.maps == ("albedo", "height") and loaded.values.shape == (256, 4)


@pytest.mark.parametrize(
    ("maps", "channels"), [(("albedo", "height"), 3), (("albedo",), 4), (("colour",), 3)]
)
def test_maps_and_channels_that_do_not(tmp_path, maps, channels):
    path = _saved(tmp_path / "a.safetensors", maps, channels)
    with pytest.raises(CheckpointError, match="not a surface texture"):
        SurfaceTexture.load(path)


def test_hard_edges_and_polygons_are_kept(tmp_path):
    flat = grid(1, 1)
    normals = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (2, 3, 1))
    polygons = Polygons(np.array([4]), np.array([[0, 1, 2], [0, 2, 3]]), np.array([3, 1, 0, 2]))
    mesh = Mesh(flat.vertices, flat.faces, flat.uv, "quad", normals, polygons)
    domain = SurfaceDomain(mesh, 16, "fixed")
    values = np.zeros((len(domain.texels.index), 3), np.float32)
    path = SurfaceTexture(domain, values, ("albedo",), ABOUT).save(tmp_path / "a.safetensors")
    loaded = SurfaceTexture.load(path).apply().mesh
    np.testing.assert_array_equal(loaded.corner_normals, normals)
    assert loaded.polygons is not None
    for name in ("sizes", "triangles", "vertices"):
        np.testing.assert_array_equal(getattr(loaded.polygons, name), getattr(polygons, name))


def test_a_mesh_without_uvs(tmp_path):
    domain = SurfaceDomain(grid(2, 2), 16, "fixed")
    values = np.zeros((len(domain.texels.index), 3), np.float32)
    path = SurfaceTexture(domain, values, ("albedo",), ABOUT).save(tmp_path / "a.safetensors")
    tensors = {name: value for name, value in load_file(path).items() if name != "uv"}
    with safe_open(path, "np") as file:
        save_file(tensors, path, file.metadata())
    with pytest.raises(CheckpointError, match="without UVs"):
        SurfaceTexture.load(path)
