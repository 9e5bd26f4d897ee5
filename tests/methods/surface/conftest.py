"""A small mesh and exemplar, on which a synthesis takes a second."""

import pytest

from mitex.exemplar import Exemplar
from mitex.mesh import Mesh, icosphere


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return icosphere(6)


@pytest.fixture(scope="module")
def exemplar() -> Exemplar:
    return Exemplar.load("cobblestone").resized(48)
