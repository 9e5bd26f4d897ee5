"""How long a look grows."""

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.mesh import Lattice, icosphere
from mitex.methods.nca import NcaTexture, settling
from mitex.methods.nca.motion.cell_motion import tile_motion
from mitex.methods.nca.perception import perception
from mitex.methods.nca.ranges import square_cells
from mitex.methods.nca.settling import settling_steps
from tests.methods.nca.tiny import texture


@pytest.fixture
def exemplar():
    """Stripes, which are as regular as can be."""
    stripes = 0.5 + 0.4 * np.sin(np.arange(128) * 2 * np.pi / 16)
    albedo = np.broadcast_to(stripes[None, :, None], (128, 128, 3))
    return Exemplar({"albedo": np.ascontiguousarray(albedo, np.float32)}, "stripes")


class Patterns:
    """Stands in for `regularity`: the exemplar's, then one value after each round of growing."""

    def __init__(self, goal, *grown):
        self.goal, self.grown, self.calls = goal, grown, 0

    def __call__(self, image):
        self.calls += 1
        if self.calls == 1:
            return self.goal
        return self.grown[(self.calls - 2) // settling.REPEATS**2]


@pytest.mark.parametrize(
    ("grown", "steps"), [((0.9,), 200), ((0.3, 0.8), 500), ((0.3, 0.5, 0.6), 1000), ((0.3, 0.5, 0.9), 1000)]
)
def test_growing_stops_when_the_pattern_is_regular_enough(exemplar, monkeypatch, grown, steps):
    monkeypatch.setattr(settling, "STEPS", (2, 5, 10))
    monkeypatch.setattr(settling, "regularity", Patterns(0.8, *grown))
    ages = []
    look = texture().look
    evolve = look.evolve
    monkeypatch.setattr(look, "evolve", lambda s, o, n, g, *m: ages.append(n) or evolve(s, o, n, g, *m))
    assert settling_steps(look, exemplar, 8) == steps / 100
    assert sum(ages) == steps / 100


def test_a_moving_pattern_is_looked_at_while_it_moves(exemplar, monkeypatch):
    """To the right, by the length of the field that it was trained with."""
    monkeypatch.setattr(settling, "STEPS", (1,))
    look = texture(condition=3).look
    evolve, conditions = look.evolve, []
    monkeypatch.setattr(
        look, "evolve", lambda *arguments: conditions.append(arguments[4]) or evolve(*arguments)
    )
    assert settling_steps(look, exemplar, 8) == 1
    assert (conditions[0] == torch.tensor([1.0, 0.0, 0.0])).all() and conditions[0].shape[1] == 3


def test_a_carried_pattern_is_looked_at_while_it_is_carried(exemplar, monkeypatch):
    """As far as in its own tile."""
    monkeypatch.setattr(settling, "STEPS", (1,))
    look, about = texture().look, {"motion": "up", "motion_advection": True, "motion_period": 4.0}
    evolve, given = look.evolve, []
    monkeypatch.setattr(look, "evolve", lambda *arguments: given.append(arguments[4:]) or evolve(*arguments))
    assert settling_steps(look, exemplar, 8, about) == 1
    ((condition, advection),) = given
    expected = tile_motion(look, about, Lattice.of(square_cells(8)), None, 1.0).advection
    assert condition is None and advection is not None and expected is not None
    assert torch.equal(advection.upstream.barycentric, expected.upstream.barycentric)


def test_noise_never_is_as_regular_as_stripes(exemplar, monkeypatch):
    monkeypatch.setattr(settling, "STEPS", (1, 2))
    assert settling_steps(texture().look, exemplar, 8) == 2


def test_a_texture_grows_for_its_own_steps():
    """In `apply`, `tile` and `grow`, if nothing else is said."""
    plain = texture()
    model = NcaTexture(plain.look, {"name": "tiny", "growth_steps": 7, "density": 8})
    assert (plain.steps, model.steps) == (200, 7)
    for one, other in (
        (model.tile(16), plain.tile(16, steps=7, cells=16)),
        (model.tile(16, steps=3), plain.tile(16, steps=3, cells=16)),
    ):
        assert np.array_equal(one["albedo"], other["albedo"])
    assert not np.array_equal(model.tile(16)["albedo"], model.tile(16, steps=8)["albedo"])


@pytest.mark.parametrize("steps", ["many", 0, -5, 1e9, None])
def test_steps_of_a_damaged_file_are_not_used(steps):
    assert NcaTexture(texture().look, {"growth_steps": steps}).steps == 200


def test_growing_in_parts_is_growing():
    """The settling measures what `grow` gives."""
    look = texture().look
    operator = perception(icosphere(4), look.rule.degree, mean=look.mean)
    whole = look.evolve(look.rule.seed(operator), operator, 5, torch.Generator().manual_seed(0))
    generator = torch.Generator().manual_seed(0)
    part = look.evolve(look.rule.seed(operator), operator, 2, generator)
    assert torch.equal(look.evolve(part, operator, 3, generator), whole)
