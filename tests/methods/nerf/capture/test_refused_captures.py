"""Captures that are refused, and the words of the message."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitex.errors import CaptureError, ImageError
from mitex.methods.nerf.capture.capture import load_capture
from tests.methods.nerf.capture.ellipsoid import CENTRE, SIZE, set_alpha, write


def frame_key(key, value, index=5):
    return lambda tree: tree["frames"][index].__setitem__(key, value)


def tree_key(key, value):
    return lambda tree: tree.__setitem__(key, value)


def without(*keys):
    return lambda tree: [tree.pop(key) for key in keys]


def pose_times(matrix):
    """Multiplies the axes of frame 5."""

    def change(tree):
        pose = np.array(tree["frames"][5]["transform_matrix"])
        pose[:3, :3] = pose[:3, :3] @ np.array(matrix)
        tree["frames"][5]["transform_matrix"] = pose.tolist()

    return change


REFUSED = {
    "an image with an endless name": (frame_key("file_path", 5000 * "["), "which does not exist"),
    "missing image": (frame_key("file_path", "images/nine"), "names 'images/nine', which does not exist"),
    "no file_path": (frame_key("file_path", None), "transforms.json: frame 5 has no file_path"),
    "path outside": (frame_key("file_path", "../x.png"), "outside of"),
    "absolute path": (frame_key("file_path", "/etc/hostname"), "outside of"),
    "odd path": (frame_key("file_path", "a\0b"), "which is no path"),
    "mask outside": (frame_key("mask_path", "../../m.png"), "outside of"),
    "mask of no text": (frame_key("mask_path", 3), "mask_path"),
    "no frames": (tree_key("frames", []), "no list of frames"),
    "frame of no kind": (lambda tree: tree["frames"].insert(0, 7), "frame 0 has no file_path"),
    "other size": (tree_key("w", 50), "is 48 x 48, but its camera 50 x 48"),
    "odd number": (tree_key("fl_x", "wide"), "has fl_x 'wide'"),
    "infinite number": (tree_key("k1", math.inf), "has k1 'inf'"),
    "negative focal length": (tree_key("fl_y", -3.0), "its fl_y -3"),
    "focal length of 1": (tree_key("fl_x", 0.9), "images/000.png is 48 pixels, its fl_x 0.9"),
    "huge focal length": (tree_key("fl_x", 1e8), "its fl_x 1e+08"),
    "unknown intrinsics": (without("fl_x", "fl_y"), "has no focal length"),
    "fisheye": (tree_key("is_fisheye", True), "undistort"),
    "fisheye of Nerfstudio": (tree_key("camera_model", "OPENCV_FISHEYE"), "undistort"),
    "k3": (frame_key("k3", 0.1), "images/005.png has a lens"),
    "distortion that folds": (tree_key("k1", -3.0), "cannot be undone"),
    "distortion without bounds": (tree_key("k2", 1e11), "cannot be undone"),
    "NaN pose": (pose_times(np.diag([1.0, math.nan, 1.0])), "images/005.png has a pose with NaN"),
    "infinite pose": (pose_times(np.diag([1.0, math.inf, 1.0])), "has a pose with NaN or huge numbers"),
    "huge axis": (pose_times(np.diag([1.0, 1e12, 1.0])), "has a pose with NaN or huge numbers"),
    "sheared pose": (pose_times([[1, 0.2, 0], [0, 1, 0], [0, 0, 1]]), "is no rotation"),
    "flat pose": (pose_times(np.zeros((3, 3))), "is no rotation"),
    "mirrored pose": (pose_times(np.diag([1.0, -1.0, 1.0])), "mirrors"),
    "no pose": (frame_key("transform_matrix", [[1.0, 2.0]]), "no 4 x 4 transform_matrix"),
    "text in a pose": (frame_key("transform_matrix", [["a"] * 4] * 4), "no 4 x 4 transform_matrix"),
}


class TestRefuses:
    @pytest.mark.parametrize("name", REFUSED)
    def test_json(self, tmp_path, name):
        change, words = REFUSED[name]
        assert_refused(write(tmp_path, count=8, change=change), words)

    def test_camera_angle_out_of_range(self, tmp_path):
        def change(tree):
            without("fl_x", "fl_y")(tree)
            tree["camera_angle_x"] = 3.2

        assert_refused(write(tmp_path, count=8, change=change), "camera_angle_x 3.2")

    def test_missing_folder_and_file(self, tmp_path):
        assert_refused(tmp_path / "none", "is not a folder")
        assert_refused(tmp_path, "has no transforms.json, and 0 photos; give 8 or more")

    @pytest.mark.parametrize("text", ["", "{", '{"frames": 3}', "[]", "[" * 100_000])
    def test_damaged_json(self, tmp_path, text):
        (tmp_path / "transforms.json").write_text(text)
        assert_refused(tmp_path, "transforms.json")

    def test_truncated_image(self, tmp_path):
        write(tmp_path, count=8)
        path = tmp_path / "images" / "004.png"
        path.write_bytes(path.read_bytes()[:90])
        assert_refused(tmp_path, "004.png", ImageError)

    def test_no_alpha(self, tmp_path):
        write(tmp_path, count=8)
        path = tmp_path / "images" / "004.png"
        Image.open(path).convert("RGB").save(path)
        assert_refused(
            tmp_path, "004.png has neither alpha nor a mask; save it with alpha, or a mask as masks/004.png"
        )

    def test_mask_of_another_size(self, tmp_path):
        write(tmp_path, count=8)
        (tmp_path / "masks").mkdir()
        Image.new("L", (10, 12), 255).save(tmp_path / "masks" / "004.png")
        assert_refused(tmp_path, "004.png is 10 x 12, its image images/004.png 48 x 48")

    def test_empty_masks(self, tmp_path):
        write(tmp_path, count=8)
        set_alpha(tmp_path, [3], 0)
        assert_refused(tmp_path, "the mask of images/003.png is empty")
        set_alpha(tmp_path, [3, 6], 0)
        assert_refused(tmp_path, "the mask of images/003.png and 1 more is empty")
        set_alpha(tmp_path, range(8), 0)
        assert_refused(tmp_path, "all masks are empty")

    def test_full_masks(self, tmp_path):
        write(tmp_path, count=8)
        set_alpha(tmp_path, range(8), 255)
        assert_refused(tmp_path, "no mask leaves any background")

    def test_too_few_views(self, tmp_path):
        assert_refused(write(tmp_path, count=7), "has 7 different views; take 8 or more")

    def test_masks_that_agree_on_nothing(self, tmp_path):
        def change(tree):  # every camera looks away from the object, at a place of its own
            for k, frame in enumerate(tree["frames"]):
                pose = np.array(frame["transform_matrix"])
                pose[:3, 3] += 30.0 * pose[:3, 0] + 9.0 * k * pose[:3, 1]
                frame["transform_matrix"] = pose.tolist()

        assert_refused(write(tmp_path, count=10, change=change), "the masks agree on no object")

    def test_camera_inside_the_object(self, tmp_path):
        def change(tree):
            pose = np.array(tree["frames"][5]["transform_matrix"])
            pose[:3, 3] = CENTRE + 0.2
            tree["frames"][5]["transform_matrix"] = pose.tolist()
            set_alpha(tmp_path, [5], 255)

        assert_refused(write(tmp_path, change=change), "the camera of images/005.png is inside the object")

    def test_more_pixels_than_fit(self, tmp_path, monkeypatch):
        monkeypatch.setattr("mitex.methods.nerf.capture.capture.MAX_PIXELS", 5 * SIZE * SIZE)
        assert_refused(write(tmp_path, count=8), "the images up to images/005.png")


def assert_refused(folder: Path, words: str, kind: type[Exception] = CaptureError):
    with pytest.raises(kind, match=re.escape(words)) as error:
        load_capture(folder)
    assert "\n" not in str(error.value)
