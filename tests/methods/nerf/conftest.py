"""A small real fit, made once for all tests; and what tasks of the same photos share."""

from __future__ import annotations

from pathlib import Path

import pytest
from filelock import FileLock

from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import NerfTexture, fit
from mitex.methods.nerf.synthesis.maps import LatentMaps
from mitex.training.locate import NAME
from tests.methods.fits import small_coarse_fields
from tests.methods.nerf.tiny import SETTINGS, tiny_capture


@pytest.fixture(scope="module", autouse=True)
def _known_hulls(known_hulls: None) -> None:
    """For all tests of the method."""


@pytest.fixture(scope="session")
def base() -> Mesh:
    ball = icosphere(44)  # even enough not to be remeshed
    return Mesh(0.55 * ball.vertices, ball.faces, name="ball")


@pytest.fixture(scope="session")
def run(tmp_path_factory, base, worker_id) -> Path:
    """Fitted by the first process that asks, where tests run in several."""
    own = tmp_path_factory.getbasetemp()
    folder = (own if worker_id == "master" else own.parent) / "nerf"
    with FileLock(folder.with_suffix(".lock")), pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        if not (folder / "run" / NAME).is_file():
            small_coarse_fields(patch)
            fit(tiny_capture(), folder / "run", base_mesh=base, set=SETTINGS)
    return folder / "run"


@pytest.fixture(scope="session")
def texture(run) -> NerfTexture:
    return NerfTexture.load(run)


@pytest.fixture(scope="session")
def maps(texture) -> LatentMaps:
    return texture.synthesize(256, seed=1, patches=60, tileable=True)
