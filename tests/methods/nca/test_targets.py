"""Which channels show what, and what is read from the exemplar."""

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.methods.nca.targets import Picture, Targets, enlarged, pictures_of, state_maps

ALL = ["albedo", "ambient_occlusion", "height", "normal", "roughness"]
HIDDEN = {3, 4, 5, 12, 13, 14, 15}


@pytest.fixture(scope="module")
def network():
    return Vgg16(precision="float32")


@pytest.fixture(scope="module")
def scales():
    return Exemplar.load("scales").resized(32)


def test_maps_of_a_state():
    """The authors' channels; value = state + 0.5, clipped."""
    state = np.arange(16, dtype=np.float32)[None] / 20 - 0.55
    state[0, 1] = -0.9
    state[0, 11] = 0.8
    maps = state_maps(state, ALL)
    assert list(maps) == ALL
    assert np.allclose(maps["albedo"], [[0, 0, 0.05]])
    assert np.allclose(maps["height"], [[0.25]])
    assert np.allclose(maps["normal"], [[0.3, 0.35, 0.4]])
    assert np.allclose(maps["roughness"], [[0.45]])
    assert np.allclose(maps["ambient_occlusion"], [[1]])
    assert list(state_maps(state, ["height"])) == ["height"]


def test_pictures_of_the_paper():
    """One for each map, in alphabetical order; grey ones are shown three times."""
    assert pictures_of(["roughness", "albedo", "normal"], blend=False, seed=0) == [
        Picture("albedo", (0, 1, 2)),
        Picture("normal", (7, 8, 9)),
        Picture("roughness", (10, 10, 10)),
    ]


def test_blended_pictures_of_all_maps():
    pictures = pictures_of(ALL, blend=True, seed=0)
    kinds = [p.kind for p in pictures]
    assert kinds == ["albedo", "normal", "grey", *["mix"] * 12]
    assert sorted(pictures[2].channels) == [6, 10, 11]
    of = {c: name for name, channels in _channels().items() for c in channels}
    for mix in pictures[3:]:
        assert len({of[c] for c in mix.channels}) == 3
    assert {of[c] for mix in pictures[3:] for c in mix.channels} == set(ALL)
    assert not {c for p in pictures for c in p.channels} & HIDDEN


def _channels():
    return {
        "albedo": (0, 1, 2),
        "height": (6,),
        "normal": (7, 8, 9),
        "roughness": (10,),
        "ambient_occlusion": (11,),
    }


@pytest.mark.parametrize("maps", [["albedo"], ["height"], ["albedo", "height"], ["height", "roughness"], ALL])
@pytest.mark.parametrize("blend", [False, True])
def test_every_map_is_in_some_picture(maps, blend):
    shown = {c for p in pictures_of(maps, blend, 0) for c in p.channels}
    assert shown == {c for name in maps for c in _channels()[name]}


def test_mixes_follow_the_seed():
    one, again, other = (pictures_of(ALL, True, seed) for seed in (1, 1, 2))
    assert one == again != other
    assert [p.kind for p in pictures_of(["albedo"], True, 0)] == ["albedo"]


def test_targets_read_the_features_of_the_pictures(network, scales):
    pictures = pictures_of(ALL, True, 0)[:4]
    targets = Targets(scales, pictures, network, ("relu1_1", "relu3_1"))
    grey = torch.from_numpy(
        np.concatenate([scales.maps[name] for name in ("ambient_occlusion", "height", "roughness")], 2)
    )
    order = [{11: 0, 6: 1, 10: 2}[c] for c in pictures[2].channels]
    assert torch.equal(targets.images[2], grey[..., order])
    maps = network.features(targets.images[[2, 0]], ["relu3_1"])["relu3_1"]
    assert targets.size("relu3_1") == 64 and targets.size("relu1_1") == targets.size("colour") == 1024
    where = torch.tensor([[0, 63, 9], [17, 17, 1]])
    found = targets.sample("relu3_1", torch.tensor([2, 0]), where)
    for k in range(2):
        assert torch.allclose(found[k], maps[k].flatten(0, 1)[where[k]], atol=1e-5)
    colours = targets.sample("colour", torch.tensor([1]), torch.tensor([[33]]))
    assert torch.equal(colours[0, 0], targets.images[1, 1, 1])


def test_enlarging_is_bilinear():
    ramp = np.array([[0.0, 1.0], [0.0, 1.0]], np.float32)[..., None]
    wide = enlarged(Exemplar({"height": ramp}), 4).maps["height"]
    assert np.allclose(wide[..., 0], [[0, 0.25, 0.75, 1]] * 4)


def test_enlarging_to_the_same_size_changes_nothing(scales):
    assert enlarged(scales, 32) is scales
