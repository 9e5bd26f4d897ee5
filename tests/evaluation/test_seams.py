"""The measure of seams tells seams from none."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.atlas import Atlas
from mitex.evaluation.seams import seam_ratio
from mitex.export.common import asset_from_textures
from mitex.mesh import icosphere
from mitex.methods.layout import with_layout

TEXELS, STEP = 192, 0.02


@pytest.fixture(scope="module")
def sphere():
    """Of several charts, and its atlas."""
    mesh = with_layout(icosphere(10), TEXELS)
    assert mesh.uv is not None
    return mesh, Atlas.from_uv(mesh.uv, TEXELS)


def asset(sphere, albedo):
    mesh, atlas = sphere
    return asset_from_textures(mesh, atlas.uv, {"albedo": albedo.astype(np.float32)}, "ball")


def waves(sphere):
    mesh, atlas = sphere
    return 0.5 + 0.5 * np.sin(9 * atlas.interpolate(mesh.vertices[mesh.faces]) + [0, 1, 2])


def test_a_smooth_function_of_space_has_no_seams(sphere):
    assert seam_ratio(asset(sphere, waves(sphere)), STEP) == pytest.approx(1, abs=0.1)


def test_a_pattern_of_the_layout_is_cut_at_seams(sphere):
    rows, columns = np.mgrid[:TEXELS, :TEXELS] / 16
    albedo = 0.5 + 0.5 * np.sin(np.stack([rows, columns, rows + columns], 2))
    assert seam_ratio(asset(sphere, albedo), STEP) > 4


def test_nothing_to_compare(sphere):
    plain = asset(sphere, np.full((TEXELS, TEXELS, 3), 0.5))
    assert np.isnan(seam_ratio(plain, STEP))
    assert np.isnan(seam_ratio(replace(plain, atlas=None, texture_maps=None), STEP))
