"""Which pictures of a set of maps are looked at."""

import numpy as np
import pytest

from mitex.exemplar import Exemplar
from mitex.triples import ChannelTriple, channel_triples, map_layout, triple_images

LAYOUT = {
    "albedo": (0, 1, 2),
    "ambient_occlusion": (11,),
    "height": (6,),
    "normal": (7, 8, 9),
    "roughness": (10,),
}


def layout(*maps):
    return {name: LAYOUT[name] for name in maps}


def test_channels_of_one_map_after_another():
    packed = map_layout(LAYOUT)
    assert list(packed) == list(LAYOUT)
    assert packed == {
        "albedo": (0, 1, 2),
        "ambient_occlusion": (3,),
        "height": (4,),
        "normal": (5, 6, 7),
        "roughness": (8,),
    }
    assert map_layout(["height", "albedo"]) == {"height": (0,), "albedo": (1, 2, 3)}


def test_pictures_of_the_paper():
    """One for each map, in alphabetical order; grey ones are shown three times."""
    assert channel_triples(layout("roughness", "albedo", "normal"), blend=False, seed=0) == [
        ChannelTriple("albedo", (0, 1, 2)),
        ChannelTriple("normal", (7, 8, 9)),
        ChannelTriple("roughness", (10, 10, 10)),
    ]


def test_blended_pictures_of_all_maps():
    pictures = channel_triples(LAYOUT, blend=True, seed=0)
    kinds = [p.kind for p in pictures]
    assert kinds == ["albedo", "normal", "grey", *["mix"] * 12]
    assert sorted(pictures[2].channels) == [6, 10, 11]
    of = {c: name for name, channels in LAYOUT.items() for c in channels}
    for mix in pictures[3:]:
        assert len({of[c] for c in mix.channels}) == 3
    assert {of[c] for mix in pictures[3:] for c in mix.channels} == set(LAYOUT)


@pytest.mark.parametrize(
    "maps", [["albedo"], ["height"], ["albedo", "height"], ["height", "roughness"], list(LAYOUT)]
)
@pytest.mark.parametrize("blend", [False, True])
def test_every_map_is_in_some_picture(maps, blend):
    channels = {c for p in channel_triples(layout(*maps), blend, 0) for c in p.channels}
    assert channels == {c for name in maps for c in LAYOUT[name]}


def test_mixes_follow_the_seed():
    one, again, other = (channel_triples(LAYOUT, True, seed) for seed in (1, 1, 2))
    assert one == again != other
    assert [p.kind for p in channel_triples(layout("albedo"), True, 0)] == ["albedo"]


def test_images_show_the_channels():
    maps = Exemplar.load("scales").resized(32).maps
    pictures = [ChannelTriple("mix", (10, 2, 8)), ChannelTriple("albedo", (0, 1, 2))]
    images = triple_images(Exemplar(maps), pictures, LAYOUT)
    expected = np.stack([maps["roughness"][..., 0], maps["albedo"][..., 2], maps["normal"][..., 1]], -1)
    assert images.dtype == np.float32 and np.array_equal(images, [expected, maps["albedo"]])
