"""Results are measured pair by pair, in whatever order they were made."""

import weakref
from types import SimpleNamespace
from typing import Any

import pytest

from mitex.comparison.measuring import measure
from mitex.errors import MeshError
from tests.comparison.test_summary import result


@pytest.fixture
def pairs():
    """Makes pairs, of which one can be there at a time; tells which pairs and pictures there were."""
    alive, told = weakref.WeakSet(), []

    class Pair:
        judge = None

        def __init__(self, exemplar, mesh):
            if mesh == "broken":
                raise MeshError("no mesh", "take another one")
            assert not alive
            alive.add(self)
            self.mesh = mesh
            told.append(mesh)

        @property
        def image(self):
            told.append("picture")

    return SimpleNamespace(of=Pair, told=told)


def store(known=()) -> Any:
    return SimpleNamespace(
        load=lambda result, pair: result if result.id in known else None,
        measure=lambda result, pair: result,
        floor=lambda pair: {"gram": len(pair.mesh)},
    )


def test_a_pair_is_there_once_and_alone(pairs):
    """The exemplar's picture is taken once."""
    made = [result(method, 0, mesh) for method in "ab" for mesh in ("ball", "vase")]
    found = measure(made, pairs.of, store(known={made[0].id}))
    assert pairs.told == ["ball", "picture", "vase"]
    assert found.results == {one.id: one for one in made} and not found.failures
    assert found.exemplars == {"lava": None}
    assert found.floors == {("lava", "ball"): {"gram": 4}, ("lava", "vase"): {"gram": 4}}


def test_what_cannot_be_measured_is_a_failure_of_its_own(pairs):
    made = [result("a", 0, "broken"), result("b", 0, "broken"), result("a", 0, "ball")]
    found = measure(made, pairs.of, store())
    assert found.failures == [
        "a-0 cannot be measured: no mesh; take another one",
        "b-0 cannot be measured: no mesh; take another one",
    ]
    assert list(found.results) == ["a-0-ball"] and list(found.floors) == [("lava", "ball")]
