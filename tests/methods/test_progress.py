"""What takes long is announced, with its parts where there are some."""

import pytest

from mitex.asset import clay
from mitex.mesh import icosphere
from mitex.methods.registry import load
from mitex.progress import listening
from mitex.render import turntable

FRAMES = 2


@pytest.fixture
def heard():
    """What is announced during a test."""
    calls = []
    with listening(lambda *call: calls.append(call)):
        yield calls


def works(calls) -> list[str]:
    return list(dict.fromkeys(work for work, _, _ in calls))


def test_growing_and_baking(heard):
    load("pebbles").apply(icosphere(3), steps=2, subdivide=0, resolution=16)
    assert works(heard)[:4] == [
        "unwrapping the mesh",
        "preparing the mesh",
        "growing the texture",
        "baking the maps",
    ]
    assert ("growing the texture", 1, 2) in heard and ("baking the maps", 0, 16) in heard


def test_growing_levels(heard):
    load("spikes").apply(icosphere(2), start_level=0, end_level=1)
    assert heard == [("growing levels", k, 2) for k in range(3)]


def test_frames_are_counted_and_their_passes_are_not(heard, tmp_path):
    turntable(clay(icosphere(2)), tmp_path / "a.gif", frames=FRAMES, resolution=16, spp=1)
    assert heard == [("rendering frames", k, FRAMES) for k in range(FRAMES + 1)]
