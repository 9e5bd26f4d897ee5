"""Networks that mask: known ones, from ONNX files written by hand, and files that are none."""

import math
from pathlib import Path

import numpy as np
import pytest

from mitex.errors import CaptureError, ConfigError, WeightsError
from mitex.features.normalisation import MEAN, SPREAD
from mitex.methods.nerf.footage import network as networks
from mitex.methods.nerf.footage.cutting import cut_out
from mitex.methods.nerf.footage.mask_method import NetworkFile, mask_method
from mitex.methods.nerf.footage.network import Network, half, read_network
from mitex.methods.nerf.footage.onnx_file import Declared, declared
from mitex.methods.nerf.footage.site import upright
from tests.methods.nerf.footage import onnx_files as onnx
from tests.methods.nerf.footage import stage

SHOTS = [stage.shot(pose) for pose in stage.POSES]
PICTURES = [picture for picture, _ in SHOTS]


@pytest.fixture(autouse=True)
def _coarse_volumes(monkeypatch):
    stage.coarse_volumes(monkeypatch)


def read(folder: Path, data: bytes, side=None, colours=None) -> Network:
    return read_network(NetworkFile(str(onnx.write(folder / "a.onnx", data)), side, colours))


def cut(folder: Path, network: Network, pictures):
    """Masks of pictures that were taken from the places of the stage."""
    names = [f"{k:02}.jpg" for k in range(stage.VIEWS)]
    for name in names:
        (folder / name).touch()
    site = upright(stage.structure(names, np.random.default_rng(0)), folder)
    return cut_out(site, pictures, mask_method("network:a.onnx"), network)


@pytest.mark.parametrize(("width", "height"), [(300, 180), (170, 260)])
@pytest.mark.parametrize("size", [("n", 3, "h", "w"), (1, 3, 96, 128), (1, 3, "h", 160)])
def test_a_disc_keeps_its_place_and_shape(tmp_path, width, height, size):
    network = read(tmp_path, onnx.redness(size=size))
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    disc = np.hypot(x - 0.3 * width, y - 0.6 * height) < 0.2 * min(width, height)
    picture = np.where(disc[..., None], (200, 90, 60), (90, 120, 110)).astype(np.uint8)
    mask = network(picture) > 0.5
    assert mask.shape == disc.shape and stage.overlap(mask, disc) > 0.95
    for axis in (0, 1):
        assert abs(np.nonzero(mask)[axis].mean() - np.nonzero(disc)[axis].mean()) < 0.5


@pytest.mark.parametrize("colours", [None, (0.5, 1.0), (0.0, 1.0)])
def test_a_network_gets_the_colours_that_it_was_trained_with(tmp_path, colours):
    """Red first, and normalised: by ImageNet's mean and deviation if nothing else is said."""
    mean, spread = (MEAN, SPREAD) if colours is None else ([colours[0]] * 3, [colours[1]] * 3)
    network = read(tmp_path, onnx.redness(mean=mean, spread=spread, steepness=10.0), colours=colours)
    answer = network(np.full((40, 50, 3), (200, 130, 110), np.uint8))
    assert answer == pytest.approx(1.0 / (1.0 + math.exp(-10.0 * (90 / 255 - 0.25))), abs=1e-5)


def test_the_size_of_its_pictures(tmp_path):
    assert read(tmp_path, onnx.redness()).size == (320, 320)
    assert read(tmp_path, onnx.redness(), side=64).size == (64, 64)
    assert read(tmp_path, onnx.redness(size=(1, 3, 48, 80))).size == (48, 80)
    assert read(tmp_path, onnx.redness(size=(1, 3, 64, 64)), side=64).size == (64, 64)
    with pytest.raises(ConfigError, match="takes pictures of 80 x 48 only; leave out ',64'"):
        read(tmp_path, onnx.redness(size=(1, 3, 48, 80)), side=64)


def test_what_a_file_declares():
    assert declared(onnx.redness(size=(1, 3, 32, 64), second=True)) == Declared(32, 64, "mask")
    assert declared(onnx.redness(size=("n", "c", "h", "w"))) == Declared(None, None, "mask")
    assert declared(onnx.redness(size=(0, 3, (1 << 64) - 1, 0))) == Declared(None, None, "mask")
    assert declared(onnx.redness(size=())) == Declared(None, None, "mask")
    assert declared(onnx.redness(listed=True)) == Declared(None, None, "mask")


def test_the_first_output_is_the_mask(tmp_path):
    alone = read(tmp_path, onnx.redness())(PICTURES[0])
    assert np.array_equal(read(tmp_path, onnx.redness(second=True))(PICTURES[0]), alone)


def test_one_half_of_what_a_network_says():
    assert half(0.0, 1.0) == half(0.3, 0.4) == half(-0.02, 1.04) == 0.5
    assert half(-7.0, 9.0) == half(-0.9, 0.9) == half(-7.0, -1.0) == 0.0
    assert half(0.0, 255.0) == half(-0.1, 255.0) == 127.5


@pytest.mark.parametrize("last", ["Sigmoid", "Identity", "Relu"])
def test_masks_are_those_of_the_object(tmp_path, last):
    """Parts, logits, and numbers from nought upwards."""
    masks = cut(tmp_path, read(tmp_path, onnx.redness(last=last, limit=0.1)), PICTURES)
    found = [stage.overlap(mask, truth) for mask, (_, truth) in zip(masks, SHOTS, strict=True)]
    assert masks[0].shape == SHOTS[0][1].shape and min(found) > 0.95


def test_what_the_pictures_do_not_agree_on_is_cut_off(tmp_path):
    pictures = [picture.copy() for picture in PICTURES]
    pictures[3][:25, :25] = (200, 40, 40)
    pictures[3][60:64, :80] = (200, 40, 40)
    pictures[5][:] = stage.WALL
    masks = cut(tmp_path, read(tmp_path, onnx.redness(limit=0.1)), pictures)
    assert stage.overlap(masks[3], SHOTS[3][1]) > 0.85 and not masks[3][:25, :25].any()
    assert not masks[5].any() and all(mask.any() for k, mask in enumerate(masks) if k != 5)


@pytest.mark.parametrize(("limit", "share"), [(0.9, "0.0"), (-0.9, "100.0")])
def test_a_network_that_masks_nothing_or_all(tmp_path, limit, share):
    network = read(tmp_path, onnx.redness(limit=limit))
    with pytest.raises(CaptureError, match=f"the network takes {share} % of the pictures for the object; "):
        cut(tmp_path, network, PICTURES)


REDNESS = onnx.redness()
# Name -> (the file, words of the message)
BAD = {
    "empty": (b"", "it holds no graph"),
    "a text": (b"hello, this is a text\n", "it is not protobuf"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(100), "it holds no graph"),
    "cut short": (REDNESS[:-40], "it is cut short"),
    "a number for a graph": (b"\x38\x01", "a number stands in the place of a message"),
    "an endless number": (b"\xff" * 40, "it is not protobuf"),
    "two inputs": (onnx.redness(pictures=2), "it has 2 inputs and 1 outputs"),
    "no output": (onnx.model([], [], [], []), "it has 0 inputs and 0 outputs"),
    "bytes": (onnx.redness(kind=onnx.UINT8), "it takes no float32 numbers"),
    "grey pictures": (onnx.redness(size=(1, 1, 64, 64)), "it takes 1 x 1 x 64 x 64 numbers, no picture"),
    "many pictures": (onnx.redness(size=(4, 3, "h", "w")), "it takes 4 x 3 x ? x ? numbers, no picture"),
    "a vector": (onnx.redness(size=(1, 3)), "it takes 1 x 3 numbers, no picture"),
    "huge pictures": (onnx.redness(size=(1, 3, 64, 9999)), "it takes pictures of 9999 x 64, a size out of"),
    "tiny pictures": (onnx.redness(size=(1, 3, 8, 64)), "it takes pictures of 64 x 8, a size out of"),
    "weights elsewhere": (onnx.redness(external=True), "its weights are in another file"),
    "two masks": (onnx.redness(masks=2), "gives 1 x 2 x 320 x 320 numbers, no mask 1 x 1 x H x W"),
    "a class": (onnx.redness(last="GlobalMaxPool", masks=5), "gives 1 x 5 x 1 x 1 numbers, no mask"),
    "not finite": (onnx.redness(last="Log"), "gives values that are not finite"),
    "unknown operation": (onnx.redness(last="Foo"), "OpenCV cannot run"),
    "a name that is no text": (REDNESS.replace(b"Sigmoid", b"Sigm\xe9id"), "OpenCV"),
}


@pytest.mark.parametrize("name", BAD)
def test_files_that_cannot_be_used(tmp_path, name, capfd):
    data, message = BAD[name]
    with pytest.raises(WeightsError) as caught:
        read(tmp_path, data)
    assert message in str(caught.value) and "a.onnx'" in str(caught.value)
    assert "\n" not in str(caught.value) and str(caught.value).endswith(networks.NEED)
    assert capfd.readouterr() == ("", "")


def test_a_file_that_makes_opencv_crash(tmp_path, monkeypatch):
    monkeypatch.setattr(networks, "TRIAL", "import os; os.abort()")
    with pytest.raises(WeightsError, match="a.onnx' makes OpenCV crash; name a network"):
        read(tmp_path, REDNESS)


def test_places_without_a_file(tmp_path, monkeypatch):
    for path, message in (("no.onnx", "No such file or directory"), (".", "it is no regular file")):
        with pytest.raises(WeightsError, match=message):
            read_network(NetworkFile(str(tmp_path / path)))
    monkeypatch.setattr(networks, "MOST_BYTES", len(REDNESS) - 1)
    with pytest.raises(WeightsError, match="it has more than"):
        read(tmp_path, REDNESS)


def test_every_cut_of_a_file_is_seen():
    for length in range(len(REDNESS)):
        with pytest.raises(ValueError, match="it is|it holds"):
            declared(REDNESS[:length])


def test_words_that_name_a_network():
    assert mask_method("network:a.onnx").network == NetworkFile("a.onnx")
    assert mask_method("network:b, c/a.ONNX,512").network == NetworkFile("b, c/a.ONNX", 512)
    assert mask_method("network:a.onnx,0.5,1").network == NetworkFile("a.onnx", None, (0.5, 1.0))
    assert mask_method("network:a.onnx,0,1").network == NetworkFile("a.onnx", None, (0.0, 1.0))
    assert mask_method("network:9.onnx,64,0.5,1.0").network == NetworkFile("9.onnx", 64, (0.5, 1.0))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("network", "is no way to mask"),
        ("network:", "is no way to mask"),
        ("network:a.pt", "is no way to mask"),
        ("network:a.onnx,big", "is no way to mask"),
        ("network:a.onnx,64,0.5,1,2", "is no way to mask"),
        ("network:a.onnx,5", "the network's size 5 is out of range; choose a value from 16 to 4096"),
        ("network:a.onnx,99999", "the network's size 99999 is out of range"),
        ("network:a.onnx,127.5,1", "the network's mean 127.5 is out of range; choose a value from 0 to 1"),
        ("network:a.onnx,0.5,0", "the network's standard deviation 0 is out of range"),
    ],
)
def test_words_that_name_none(words, message):
    with pytest.raises(ConfigError, match=message):
        mask_method(words)
