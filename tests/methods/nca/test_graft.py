"""Two textures on one mesh: each alone where the weight says so, and the published mixture in between."""

import math
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.methods.nca import Graft, NcaTexture
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import grown_state
from mitex.methods.nca.motion.cell_motion import STILL
from mitex.methods.nca.perception import perception
from mitex.methods.nca.weights import graft_weights
from tests.methods.nca import tiny

SPHERE = icosphere(4)
CELLS = Cells(SPHERE, 0, SPHERE)
ALL = ("albedo", "normal", "roughness")
OPTIONS: dict[str, Any] = {"seed": 3, "steps": 12, "subdivide": 1, "resolution": 64}


def relative(seed, family="one", maps=ALL, reach=0.3, **options):
    texture = tiny.texture(maps, seed=seed, **options)
    texture.look.low.fill_(-reach)
    texture.look.high.fill_(reach)
    palette = {"colours": [[0.2 * seed, 0.5, 0.5]], "radius": 0.2}
    return NcaTexture(texture.look, {"name": f"tiny {seed}", "family": family, "palette": palette})


@pytest.fixture(scope="module")
def pair():
    return relative(0), relative(1, reach=0.5)


def graft(pair, source):
    first, second = pair
    return Graft(first, second, graft_weights(SPHERE, source))


@pytest.mark.filterwarnings("ignore::mitex.errors.TextureWarning")
@pytest.mark.parametrize("weight", [0, 1])
def test_at_either_end_it_is_the_single_texture_bit_for_bit(pair, weight):
    """With the places that are healed, the palette, and the normals of the baked textures."""
    single, grafted = pair[weight].apply(SPHERE, **OPTIONS), graft(pair, weight).apply(SPHERE, **OPTIONS)
    assert single.texture_maps and grafted.texture_maps
    for maps, others in (
        (single.texture_maps, grafted.texture_maps),
        (single.vertex_maps, grafted.vertex_maps),
    ):
        assert maps.keys() == others.keys() and all(np.array_equal(maps[k], others[k]) for k in maps)


def words(seed, relief):
    """A texture from words, by what its file tells."""
    texture = relative(seed, maps=("albedo", "height"))
    return NcaTexture(texture.look, {**texture.about, "relief": relief})


@pytest.mark.parametrize("weight", [0, 1])
@pytest.mark.parametrize("more", [{}, {"resolution": None, "displace": True}], ids=str)
@pytest.mark.filterwarnings("ignore::mitex.errors.TextureWarning")
def test_a_relief_is_at_either_end_that_of_the_single_texture(weight, more):
    """As normals, and as a displacement."""
    pair = words(0, 2.5), words(1, 20.0)
    single, grafted = (one.apply(SPHERE, **OPTIONS | more) for one in (pair[weight], graft(pair, weight)))
    assert single.maps.keys() == grafted.maps.keys() == {"albedo", "height", "normal"}
    assert all(np.array_equal(values, grafted.maps[name]) for name, values in single.maps.items())
    assert np.array_equal(single.mesh.vertices, grafted.mesh.vertices)
    assert np.array_equal(single.mesh.vertices, SPHERE.vertices) == (not more)


def test_in_between_reliefs_are_mixed():
    """Of one height everywhere, the bounds of the offsets are left."""
    pair = words(0, 1.0), words(1, 3.0)
    growth = graft(pair, "x").growth_on(CELLS, SPHERE).displaced()
    shown = growth.texture(growth.seed())
    shown._decoded = lambda points: np.ones((len(points.face), 4), np.float32)
    offsets = np.linalg.norm(shown.asset().mesh.vertices - SPHERE.vertices, axis=1)
    edges = SPHERE.edges
    points = SPHERE.vertices.astype(np.float64)
    edge = np.linalg.norm(points[edges.indices] - points[edges.rows], axis=1).mean()
    share = graft_weights(SPHERE, "x")(points)
    assert np.allclose(offsets, edge * (1 + 2 * share), rtol=1e-4) and np.ptp(share) > 0.9


def test_a_graft_without_reliefs_displaces_nothing(pair):
    with pytest.raises(ConfigError, match="no relief that could displace"):
        graft(pair, 0).apply(SPHERE, displace=True, **OPTIONS)


TRAINED = {"motion": "right", "motion_advection": True, "motion_period": 4.0, "motion_speed": 1.2}
MOVING = {
    "one that is still": {},
    "another way, speed and period": {"motion": "up", "motion_advection": True, "motion_period": 8.0},
    "one that moves by itself": {"motion": "about-y", "motion_advection": False},
}


def moving_pair(about):
    """A moving texture, and another one, which has not learned to move if there is nothing about it."""
    pair = relative(0, condition=3), relative(1, reach=0.5, condition=3 if about else 0)
    return [
        NcaTexture(one.look, {**one.about, **more}) for one, more in zip(pair, (TRAINED, about), strict=True)
    ]


@pytest.mark.filterwarnings("ignore::mitex.errors.TextureWarning")
@pytest.mark.parametrize("weight", [0, 1])
@pytest.mark.parametrize("motion", [{}, {"field": "about-x"}, {"field": "down", "speed": 0.5}], ids=str)
@pytest.mark.parametrize("name", MOVING)
def test_a_moving_one_is_at_either_end_as_it_moves_alone(name, motion, weight):
    pair = moving_pair(MOVING[name])
    grafted = graft(pair, weight).growth_on(CELLS, SPHERE, 30.0, **motion)
    single = pair[weight].grow(SPHERE, seed=3, steps=6, orientation=30.0, **motion)
    assert torch.equal(grown_state(grafted, 3, 6), single)
    still = MOVING[name] == {} and weight == 1 and not motion
    assert (pair[weight].motion(CELLS, **motion) is STILL) == still


@pytest.mark.parametrize("periods", [(4.0, 4.0), (4.0, 8.0)])
def test_in_between_a_pattern_goes_the_ways_mixed(periods):
    """Around the y axis, with rules that change nothing."""
    pair = []
    for seed, period in enumerate(periods):
        texture = relative(seed, maps=("albedo",), shape=None, reach=9.0)
        for weight in texture.look.rule.parameters():
            weight.data.zero_()
        pair.append(NcaTexture(texture.look, {**texture.about, "motion_period": period}))
    mesh = icosphere(16)
    growth = graft(pair, "0.25").growth_on(Cells(mesh, 0, mesh), mesh, field="about-y", speed=1.5)
    x, _, z = torch.tensor(mesh.vertices).T
    state = torch.zeros_like(growth.seed())
    state[:, 0], state[:, 1] = x, z
    a, b, *_ = growth.evolve(state, 12, torch.Generator()).T
    turned = math.atan2(x @ b - z @ a, x @ a + z @ b)
    angle = 12 * (0.75 / periods[0] + 0.25 / periods[1]) * 1.5 * float(mesh.edge_lengths.mean()) * 4 / math.pi
    assert turned == pytest.approx(angle, rel=0.02)


@pytest.mark.filterwarnings("ignore::mitex.errors.TextureWarning")
def test_a_speed_of_one_that_stands_still():
    with pytest.raises(ConfigError, match="'tiny 1' stands still, so that a speed means nothing"):
        graft(moving_pair({}), "x").apply(SPHERE, steps=200_000_000, speed=2.0)


def test_updates_are_mixed_by_the_weights_of_the_vertices(pair):
    """Equation of section 3.3.2, with one mask for both, and within bounds that are mixed too."""
    growth = graft(pair, "x").growth_on(CELLS, SPHERE)
    share = torch.from_numpy(graft_weights(SPHERE, "x")(SPHERE.vertices.astype(np.float64)))[:, None]
    operator, generator = perception(SPHERE, 1, mean=True), torch.Generator().manual_seed(5)
    state = growth.seed()
    reach = 1.1 * (0.3 + share * 0.2)
    with torch.no_grad():
        for _ in range(6):
            mask = torch.rand(1, len(state), generator=generator)[0] < 0.5
            first, second = (texture.look.rule.step(state[None], operator)[0] - state for texture in pair)
            update = (1 - share) * first + share * second
            state = torch.where(mask[:, None], state + update, state)
            state = torch.minimum(torch.maximum(state, -reach), reach)
    grown = grown_state(growth, 5, 6)
    assert torch.allclose(grown, state, atol=1e-5) and state.abs().max() > 0.1


def test_maps_are_those_of_a_decoder_mixed_by_the_weight_at_the_point():
    """Point by point, against a look whose weights are mixed by the weight there."""
    pair = [NcaTexture(texture.look, {"family": "one"}) for texture in (relative(0), relative(1))]
    growth = graft(pair, "x").growth_on(CELLS, SPHERE)
    state = grown_state(growth, 0, 5)
    face = np.arange(0, len(SPHERE.faces), 16, dtype=np.int32)
    barycentric = np.full((len(face), 3), 1 / 3, np.float32)
    mixed = growth.texture(state).values(face, barycentric)
    places = SPHERE.vertices[SPHERE.faces[face]].mean(axis=1, dtype=np.float64)
    own, others = (texture.look.state_dict() for texture in pair)
    for k, share in enumerate(graft_weights(SPHERE, "x")(places)):
        look = deepcopy(pair[0].look)
        look.load_state_dict({name: torch.lerp(own[name], others[name], float(share)) for name in own})
        expected = GrownTexture(look, state, CELLS).values(face[k : k + 1], barycentric[k : k + 1])
        assert np.allclose(mixed[k], expected[0], atol=1e-4)
    assert np.abs(mixed - pair[0].growth(CELLS).texture(state).values(face, barycentric)).max() > 0.05


def test_maps_that_are_channels_are_the_state(pair):
    plain = [NcaTexture(relative(seed, shape=None).look, {"family": "one"}) for seed in (0, 1)]
    growth = graft(plain, "x").growth_on(CELLS, SPHERE)
    state = grown_state(growth, 0, 5)
    albedo = growth.texture(state).at_vertices()["albedo"]
    assert np.allclose(albedo, np.clip(state[:, :3].numpy() + 0.5, 0, 1), atol=1e-6)


def test_it_needs_as_many_steps_as_the_slower_one(pair):
    slow = NcaTexture(pair[1].look, {**pair[1].about, "growth_steps": 500})
    assert Graft(pair[0], slow, graft_weights(SPHERE, 0)).steps == 500


def test_its_pattern_is_as_wide_as_asked_for(pair):
    """An exemplar's width over cells of the mean density of the two, which ships with some models."""
    first, second = (
        NcaTexture(one.look, {**one.about, "density": d}) for one, d in zip(pair, (16, 36), strict=True)
    )
    grafted = Graft(first, second, lambda points: np.zeros(len(points), np.float32))
    assert grafted.density == 24
    assert Graft(pair[0], pair[1], grafted.weights).density == 32


def test_only_one_family_can_be_grafted(pair):
    with pytest.raises(ConfigError, match="'tiny 0' and 'tiny 2' are not of one family"):
        graft((pair[0], relative(2, family="another")), "x")
    with pytest.raises(ConfigError, match="differ in fc1, .*hidden|differ in .*rule.fc1"):
        graft((pair[0], relative(2, hidden=64)), "x")
    with pytest.raises(ConfigError, match="differ in rule.fc1.weight"):
        graft((relative(0, condition=3), relative(2, condition=5)), "x")
    with pytest.raises(ConfigError, match="differ in .*maps"):
        graft((pair[0], relative(2, maps=("albedo",))), "x")


def test_a_texture_of_no_known_family_is_its_own(pair):
    alone = NcaTexture(pair[0].look, {"name": "alone"})
    assert Graft(alone, NcaTexture(pair[0].look), graft_weights(SPHERE, 0)).steps == alone.steps
    with pytest.raises(ConfigError, match="not of one family"):
        graft((alone, NcaTexture(pair[1].look)), 0)


def test_bundled_models_are_one_family():
    from mitex.methods.registry import bundled, methods

    families = {NcaTexture.load(path).about["family"] for path in bundled(methods()["nca"]).values()}
    assert families == {NcaTexture.load("ceramic").about["family"]}
