"""Boxes on a mesh, at the size of tests."""

from __future__ import annotations

import pytest

from mitex.methods.baselines.nerf_tex import instances
from mitex.methods.baselines.nerf_tex.box import take_box
from mitex.runtime import init
from tests.methods.baselines.nerf_tex.small import captured

init()


@pytest.fixture(scope="module", autouse=True)
def coarse():
    """Occupied cells are looked for on a coarse grid."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(instances, "FINER", 1)
        patch.setattr(instances, "REFRESHES", 1)
        yield


@pytest.fixture(scope="module")
def box():
    return take_box(captured(), 128, 0)
