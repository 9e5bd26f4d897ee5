"""Texture files that do not fit together."""

import numpy as np
import pytest

from mitex.errors import CheckpointError
from mitex.mesh import grid
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
