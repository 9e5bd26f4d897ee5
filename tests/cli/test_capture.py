"""`mitex capture`: a whole capture from a film, and captures that cannot be made."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from mitex.cli import main
from mitex.errors import CaptureError, ConfigError
from mitex.methods.nerf import load_capture
from mitex.methods.nerf.footage import site
from mitex.methods.nerf.footage.making import make_capture
from mitex.methods.nerf.footage.pictures import footage
from tests.cli import bad_files as bad
from tests.cli.refusals import check_refused, tree
from tests.methods.nerf.footage import onnx_files, stage
from tests.methods.nerf.footage.films import write_film, write_photos, write_sound

pytestmark = pytest.mark.usefixtures("own_cache")
SHOTS = [stage.shot(pose) for pose in stage.POSES]
PICTURES = [picture for picture, _ in SHOTS]


@pytest.fixture(autouse=True)
def _coarse_volumes(monkeypatch):
    stage.coarse_volumes(monkeypatch)


@pytest.fixture
def cameras(monkeypatch):
    """Known cameras in the place of those that COLMAP would find, which takes long."""

    monkeypatch.setattr(
        site, "reconstruct", lambda folder, names: stage.structure(names, np.random.default_rng(0))
    )


def test_a_film_becomes_a_capture(cameras, tmp_path, capsys):
    # Every second frame is a blurred one.
    blurred = [(p.astype(float) + np.roll(p, 12, axis=1) + np.roll(p, 24, axis=1)) / 3 for p in PICTURES]
    frames = [f for pair in zip(PICTURES, blurred, strict=True) for f in (pair[0], pair[1].astype(np.uint8))]
    film = write_film(tmp_path / "a.mp4", frames)
    out = tmp_path / "captures" / "a"
    words = [
        "capture",
        str(film),
        "--out",
        str(out),
        "--mask",
        "plane",
        "--frames",
        str(stage.VIEWS),
        "--quiet",
    ]
    assert main(words) == 0
    printed = capsys.readouterr()
    lines = printed.out.splitlines()
    assert lines[0] == f"{stage.VIEWS} of {2 * stage.VIEWS} pictures picked"
    assert lines[1] == f"{stage.VIEWS} of them got a camera" and lines[-1] == str(out)
    assert any(line.startswith("film it all around from above") for line in lines[3:-1])

    capture = load_capture(out)
    assert capture.names == tuple(f"images/{2 * k:05}.jpg" for k in range(stage.VIEWS))
    for image, (picture, mask) in zip(capture.images, SHOTS, strict=True):
        assert stage.overlap(image[..., 3] > 127, mask) > 0.9
        assert np.abs(image[..., :3].astype(int) - picture).mean() < 8
    assert tree(tmp_path).keys() >= {"captures/a/transforms.json"}
    assert [path.name for path in out.parent.iterdir()] == ["a"]  # nothing beside it
    # Up is up: the cameras stand at their heights above the object.
    backs = np.array(
        [frame["transform_matrix"] for frame in json.loads((out / "transforms.json").read_text())["frames"]]
    )
    assert np.allclose(backs[:, 2, 2], [pose[2, 2] for pose in stage.POSES], atol=0.01)


def test_masks_by_a_network(cameras, tmp_path, capsys):
    write_photos(tmp_path / "photos", PICTURES)
    network = onnx_files.write(tmp_path / "red.onnx", onnx_files.redness(limit=0.2, size=(1, 3, 96, 96)))
    words = ["capture", str(tmp_path / "photos"), "--out", str(tmp_path / "a"), "--quiet"]
    assert main([*words, "--mask", f"network:{network}"]) == 0
    assert f"{stage.VIEWS} of those got a mask" in capsys.readouterr().out
    for image, (_, mask) in zip(load_capture(tmp_path / "a").images, SHOTS, strict=True):
        assert stage.overlap(image[..., 3] > 127, mask) > 0.95


@pytest.mark.parametrize("mask", ["hull", "box:25,15,50,70", "colour:#28963c"])
def test_masks_without_a_network(mask, cameras, tmp_path, capsys):
    bare = [np.where(truth[..., None], picture, np.array(stage.WALL, np.uint8)) for picture, truth in SHOTS]
    write_photos(tmp_path / "photos", bare if mask.startswith("colour") else PICTURES)
    words = ["capture", str(tmp_path / "photos"), "--out", str(tmp_path / "a"), "--mask", mask, "--quiet"]
    assert main(words) == 0
    assert f"{stage.VIEWS} of those got a mask" in capsys.readouterr().out
    images = load_capture(tmp_path / "a").images
    overlaps = [
        stage.overlap(image[..., 3] > 127, truth) for image, (_, truth) in zip(images, SHOTS, strict=True)
    ]
    assert np.median(overlaps) > 0.9 and min(overlaps) > 0.75


def test_smaller_pictures(monkeypatch, tmp_path):
    """COLMAP sees them as they are kept."""
    seen = []

    def smaller(folder, names):
        seen.extend(Image.open(folder / name).size for name in names)
        structure = stage.structure(names, np.random.default_rng(0))
        for frame in structure.tree["frames"]:
            frame.update({key: 0.8 * frame[key] for key in ("fl_x", "fl_y", "cx", "cy")})
            frame.update(w=128, h=96)
        return structure

    monkeypatch.setattr(site, "reconstruct", smaller)
    write_photos(tmp_path / "photos", PICTURES)
    words = [
        "capture",
        str(tmp_path / "photos"),
        "--out",
        str(tmp_path / "a"),
        "--resolution",
        "128",
        "--quiet",
    ]
    assert main(words) == 0
    assert set(seen) == {(128, 96)}
    assert {image.shape for image in load_capture(tmp_path / "a").images} == {(96, 128, 4)}


def shots(folder):
    return write_photos(folder / "photos", PICTURES)


# Name -> (what makes the files, the video or folder, further words, words of the message)
BAD = {
    "missing": (lambda d: None, "no.mp4", "", "does not exist"),
    "text named mp4": (lambda d: bad.text(d / "a.mp4"), "a.mp4", "", "not a video that ffmpeg can read"),
    "empty file": (lambda d: bad.text(d / "a.mov", ""), "a.mov", "", "not a video that ffmpeg can read"),
    "cut mp4": (
        lambda d: bad.cut(write_film(d / "a.mp4", PICTURES)),
        "a.mp4",
        "",
        "not a video that ffmpeg can read",
    ),
    "sound alone": (lambda d: write_sound(d / "a.mp4"), "a.mp4", "", "not a video that ffmpeg can read"),
    "a picture": (lambda d: bad.image(d / "a.png"), "a.png", "", "1 pictures to work with"),
    "a camera that stands still": (
        lambda d: write_film(d / "a.mp4", PICTURES[:1] * 30),
        "a.mp4",
        "",
        "1 pictures to work with (29 like the one before)",
    ),
    "a short film": (lambda d: write_film(d / "a.mp4", PICTURES[:5]), "a.mp4", "", "5 pictures to work with"),
    "a folder without photos": (lambda d: bad.text(d / "photos" / "a.txt"), "photos", "", "holds no photos"),
    "few photos": (
        lambda d: write_photos(d / "photos", PICTURES[:5]),
        "photos",
        "",
        "5 pictures to work with",
    ),
    "a phone's photos": (
        lambda d: bad.text(write_photos(d / "photos", PICTURES) / "IMG_1.HEIC"),
        "photos",
        "",
        "IMG_1.HEIC is a HEIC photo, which Mitex cannot read; export photos as JPEG",
    ),
    "a damaged photo": (
        lambda d: bad.cut(shots(d) / "p03.jpg"),
        "photos",
        "",
        "p03.jpg is damaged or cut short",
    ),
    "a tiny photo": (
        lambda d: bad.image(shots(d) / "p99.png", (1, 1)),
        "photos",
        "",
        "p99.png gives pictures of 1 x 1 pixels",
    ),
    "a narrow photo": (
        lambda d: bad.image(shots(d) / "p99.png", (9000, 20)),
        "photos",
        "--resolution 128",
        "p99.png gives pictures of 128 x 1 pixels",
    ),
    "a long name": (lambda d: None, 300 * "a", "", "cannot be read (File name too long)"),
    "no such way": (shots, "photos", "--mask magic", "'magic' is no way to mask"),
    "a box outside": (shots, "photos", "--mask box:80,0,40,10", "not inside the picture"),
    "a colour that is nowhere": (shots, "photos", "--mask colour:#ff00ff", "have the background's colour"),
    "a network that is missing": (
        shots,
        "photos",
        "--mask network:no.onnx",
        "no.onnx' cannot be used (No such",
    ),
    "a network that is none": (
        lambda d: [shots(d), bad.text(d / "a.onnx")],
        "photos",
        "--mask network:a.onnx",
        "a.onnx' cannot be used (it is not protobuf)",
    ),
    "a network that OpenCV cannot run": (
        lambda d: [shots(d), onnx_files.write(d / "a.onnx", onnx_files.redness(last="Foo"))],
        "photos",
        "--mask network:a.onnx",
        "a.onnx' ((-2:Unspecified error) Can't create layer",
    ),
    "a network for other pictures": (
        lambda d: [shots(d), onnx_files.write(d / "a.onnx", onnx_files.redness(size=(1, 3, 64, 64)))],
        "photos",
        "--mask network:a.onnx,320",
        "a.onnx' takes pictures of 64 x 64 only",
    ),
    "a network that masks nothing": (
        lambda d: [shots(d), onnx_files.write(d / "a.onnx", onnx_files.redness(limit=0.9))],
        "photos",
        "--mask network:a.onnx",
        "the network takes 0.0 % of the pictures for the object",
    ),
    "few frames asked for": (shots, "photos", "--frames 3", "--frames 3 is out of range"),
    "huge pictures asked for": (shots, "photos", "--resolution 99999", "--resolution 99999 is out of range"),
    "into a folder that exists": (
        lambda d: [shots(d), bad.text(d / "out" / "run" / "mine.txt")],
        "photos",
        "--out out/run",
        "exists; name a new folder",
    ),
    "a long name to write": (shots, "photos", f"--out {300 * 'b'}", "is too long; use a shorter one"),
    "among the photos": (shots, "photos", "--out photos/capture", "is among the photos"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_captured(cameras, name, files, capsys):
    make, source, words, message = BAD[name]
    make(files)
    out = [] if "--out" in words else ["--out", "out/new/capture"]
    check_refused(files, ["capture", source, *out, *words.split(), "--quiet"], message, capsys)


def test_the_current_folder_is_refused_before_any_work(files, monkeypatch, capsys):
    """Although it is empty: it would be replaced under the feet of who works in it."""
    shots(files)
    monkeypatch.chdir(files / "out")
    message = "out' is the current folder; name a new one"
    check_refused(files, ["capture", "../no.mp4", "--out", "."], message, capsys)


def test_a_link_to_an_empty_folder_stays(cameras, files):
    shots(files)
    (files / "link").symlink_to("out")
    assert main(["capture", "photos", "--out", "link", "--quiet"]) == 0
    assert (files / "link").is_symlink() and (files / "out" / "transforms.json").is_file()
    assert not list(files.glob(".filling-*"))


def test_a_folder_that_may_not_be_read(files, monkeypatch):
    """Root may read everything, so the system's answer is given here."""
    shots(files)

    def refuse(folder):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(CaptureError, match=r"photos cannot be read \(Permission denied\); check its name"):
        footage("photos", 1600)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"frames": 7}, "`frames` 7 is out of range"),
        ({"frames": 1001}, "`frames` 1001 is out of range"),
        ({"resolution": 127}, "`resolution` 127 is out of range"),
        ({"resolution": 8193}, "`resolution` 8193 is out of range"),
    ],
)
def test_numbers_out_of_range_in_python(option, message, tmp_path):
    with pytest.raises(ConfigError, match=message):
        make_capture(tmp_path, tmp_path / "capture", **option)


def test_another_way_to_mask_needs_no_other_cameras(monkeypatch, tmp_path):
    """Of more photos than asked for, where the first, which a box is in, is not the sharpest of its part."""
    blurred = ndimage.gaussian_filter(PICTURES[0], (1.0, 1.0, 0.0))
    write_photos(tmp_path / "photos", [blurred, *(p for p in PICTURES for _ in range(2))][:-1])
    asked = []

    def reconstruct(folder, names):
        asked.append(names)
        return stage.structure(names, np.random.default_rng(0))

    monkeypatch.setattr(site, "VERSION", "another way to mask")  # of what is in the cache
    monkeypatch.setattr(site, "reconstruct", reconstruct)
    for place, mask in (("a", "plane"), ("b", "box:25,15,50,70")):
        make_capture(tmp_path / "photos", tmp_path / place, mask, frames=stage.VIEWS)
    (names,) = asked
    assert Path(names[0]).stem == "p00" and len(names) == stage.VIEWS


def test_a_box_in_a_picture_without_a_camera(monkeypatch, files, capsys):
    def without_the_first(folder, names):
        whole = stage.structure(names, np.random.default_rng(0))
        later = whole.sightings[whole.sightings[:, 0] > 0] - (1, 0)
        return replace(whole, tree={"frames": whole.tree["frames"][1:]}, sightings=later)

    monkeypatch.setattr(site, "VERSION", "without the first")  # of what is in the cache
    monkeypatch.setattr(site, "reconstruct", without_the_first)
    write_photos(files / "photos", PICTURES)
    words = ["capture", "photos", "--out", "out/c", "--quiet", "--mask"]
    message = "the first picture, which the box is in, got no camera; mask in another way"
    check_refused(files, [*words, "box:25,15,50,70"], message, capsys)


def test_too_few_masks(cameras, monkeypatch, files, capsys):
    """A capture needs eight."""

    def cut_out(site, pictures, *_):
        return [mask & (k < 7) for k, (_, mask) in enumerate(SHOTS)]

    monkeypatch.setattr("mitex.methods.nerf.footage.cutting.cut_out", cut_out)
    write_photos(files / "photos", PICTURES)
    message = f"only 7 of {stage.VIEWS} pictures could be masked; mask the object in another way"
    check_refused(files, ["capture", "photos", "--out", "out/c", "--quiet"], message, capsys)


def test_photos_that_do_not_overlap(monkeypatch, files, capsys):
    def lost(folder, names):
        raise CaptureError("only 0 of 10 photos could be placed", "take overlapping ones")

    monkeypatch.setattr(site, "reconstruct", lost)
    write_photos(files / "photos", PICTURES[::-1])
    check_refused(files, ["capture", "photos", "--out", "out/c", "--quiet"], "only 0 of 10 photos", capsys)


def test_without_opencv(cameras, monkeypatch, files, capsys):
    monkeypatch.setitem(sys.modules, "cv2", None)
    for module in ("cutting", "network", "silhouette"):
        monkeypatch.delitem(sys.modules, f"mitex.methods.nerf.footage.{module}", raising=False)
    shots(files)
    message = "import of cv2 halted; None in sys.modules); run `pip install 'mitex[nerf]'`"
    check_refused(files, ["capture", "photos", "--out", "out/c", "--quiet"], message, capsys)
