"""A small real fit, made once for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import NerfTexture, fit
from mitex.methods.nerf.synthesis.maps import LatentMaps
from tests.methods.nerf.tiny import SETTINGS, tiny_capture


@pytest.fixture(scope="session")
def base() -> Mesh:
    ball = icosphere(44)  # even enough not to be remeshed
    return Mesh(0.55 * ball.vertices, ball.faces, name="ball")


@pytest.fixture(scope="session")
def run(tmp_path_factory, base) -> Path:
    folder = tmp_path_factory.mktemp("nerf")
    patch = pytest.MonkeyPatch()
    patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    fit(tiny_capture(), folder / "run", base_mesh=base, set=SETTINGS)
    patch.undo()
    return folder / "run"


@pytest.fixture(scope="session")
def texture(run) -> NerfTexture:
    return NerfTexture.load(run)


@pytest.fixture(scope="session")
def maps(texture) -> LatentMaps:
    return texture.synthesize(256, seed=1, patches=60, tileable=True)
