"""Captures of an ellipsoid whose every ray is known: cameras, scene cube, and what is refused."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitex.errors import CaptureError, CaptureWarning, ImageError
from mitex.mesh import Similarity
from mitex.methods.nerf.capture.capture import Capture, load_capture

RADII = np.array([1.0, 0.7, 0.5])
CENTRE = np.array([5.0, -3.0, 2.0])
SIZE = 48
FOCAL = 60.0


def look_at(direction, distance=4.0, target=CENTRE):
    """Camera -> world, (4, 4): at `distance` in the given direction from the target, looking at it."""
    back = np.asarray(direction, float) / np.linalg.norm(direction)
    right = np.cross([0.1, 0.2, 1.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(back, right), back, target + distance * back], axis=1)
    return pose


def directions(count):
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, math.pi * (3 - math.sqrt(5)) * k
    return np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)


def ellipsoid_mask(pose, width=SIZE, height=SIZE, focal=FOCAL):
    """(H, W) bool: which pixel centres show the ellipsoid."""
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    rays = np.stack([x / focal, -y / focal, -np.ones_like(x)], axis=-1) @ pose[:3, :3].T / RADII
    start = (pose[:3, 3] - CENTRE) / RADII
    a, b, c = (rays**2).sum(-1), rays @ start, start @ start - 1
    return (b * b - a * c >= 0) & (b < 0)


def rgba(mask, colour=(200, 120, 40)):
    return np.concatenate(
        [np.broadcast_to(np.uint8(colour), (*mask.shape, 3)), np.uint8(255) * mask[..., None]], 2
    )


def write(folder, count=12, change=None, frames=None):
    """A capture with alpha; `change(tree)` edits the JSON before it is written."""
    (folder / "images").mkdir(parents=True, exist_ok=True)
    tree = {"fl_x": FOCAL, "fl_y": FOCAL, "w": SIZE, "h": SIZE, "cx": SIZE / 2, "cy": SIZE / 2, "frames": []}
    for k, direction in enumerate(directions(count)):
        pose = look_at(direction)
        Image.fromarray(rgba(ellipsoid_mask(pose))).save(folder / "images" / f"{k:03}.png")
        tree["frames"].append({"file_path": f"images/{k:03}.png", "transform_matrix": pose.tolist()})
    if change:
        change(tree)
    (folder / "transforms.json").write_text(json.dumps(tree))
    return folder


def surface(count=200):
    """Points of the ellipsoid in the capture's world."""
    return CENTRE + RADII * directions(count)


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    return load_capture(write(tmp_path_factory.mktemp("ball") / "ball"))


class TestCameras:
    def test_rays_pass_through_points_whose_pixels_are_known(self, capture):
        """The pixels come from the file's numbers by hand, not from the class under test."""
        points = surface()
        tree_pose = look_at(directions(12)[3])
        local = (points - tree_pose[:3, 3]) @ tree_pose[:3, :3]
        pixels = np.stack(
            [SIZE / 2 + FOCAL * local[:, 0] / -local[:, 2], SIZE / 2 - FOCAL * local[:, 1] / -local[:, 2]],
            axis=1,
        )
        origins, rays = capture.rays(3, pixels)
        assert origins.dtype == rays.dtype == np.float32
        assert np.allclose(np.linalg.norm(rays, axis=1), 1.0, atol=1e-6)
        assert_on_rays(capture.similarity.apply(points), origins, rays)

    def test_one_view_for_each_pixel(self, capture, rng):
        views, pixels = rng.integers(0, 12, 30), rng.uniform(0, SIZE, (30, 2))
        together = capture.rays(views, pixels)
        for k in range(30):
            for both, one in zip(together, capture.rays(int(views[k]), pixels[k : k + 1]), strict=True):
                assert np.allclose(both[k], one[0], atol=1e-6)

    def test_rays_undo_the_distortion_of_projected_points(self, tmp_path):
        lens = {"k1": -0.21, "k2": 0.08, "p1": 0.004, "p2": -0.003}
        bent = load_capture(write(tmp_path, change=lambda tree: tree.update(lens)))
        points = bent.similarity.apply(surface())
        for view in range(len(bent)):
            pixels, depth = bent.project(view, points)
            assert (depth > 0).all()
            assert_on_rays(points, *bent.rays(view, pixels))
        plain, _ = opencv_pixels(surface(), look_at(directions(12)[5]), lens)
        assert np.allclose(bent.project(5, points)[0], plain, atol=1e-3)

    def test_intrinsics_of_every_kind_and_of_single_frames(self, tmp_path):
        def change(tree):
            for key in ("fl_x", "fl_y", "cx", "cy"):
                del tree[key]
            tree["camera_angle_x"] = 2 * math.atan(0.5 * SIZE / FOCAL)
            tree["frames"][2] |= {"fl_x": 59.0, "fl_y": 61.0, "cx": 23.0, "cy": 25.0, "k1": 0.01}
            tree["frames"][3] |= {"fl_y": 58.0}

        loaded = load_capture(write(tmp_path, change=change))
        assert np.allclose(loaded.intrinsics[0], [FOCAL, FOCAL, SIZE / 2, SIZE / 2])
        assert np.allclose(loaded.intrinsics[2], [59, 61, 23, 25])
        assert np.allclose(loaded.intrinsics[3], [FOCAL, 58, SIZE / 2, SIZE / 2])
        assert np.allclose(loaded.distortion[2], [0.01, 0, 0, 0]) and not loaded.distortion[0].any()

    def test_images_of_different_sizes(self, tmp_path):
        def change(tree):
            pose = np.array(tree["frames"][4]["transform_matrix"])
            Image.fromarray(rgba(ellipsoid_mask(pose, 80, 60, 70.0))).save(tmp_path / "images" / "004.png")
            tree["frames"][4] |= {"w": 80, "h": 60, "fl_x": 70.0, "fl_y": 70.0, "cx": 40.0, "cy": 30.0}

        loaded = load_capture(write(tmp_path, change=change))
        assert loaded.images[4].shape == (60, 80, 4) and loaded.images[5].shape == (SIZE, SIZE, 4)

    def test_split_holds_out_every_eighth(self, capture):
        training, held_out = capture.split()
        assert held_out.names == ("images/000.png", "images/008.png") and len(training) == 10
        assert np.array_equal(held_out.poses, capture.poses[[0, 8]])
        assert held_out.images[1] is capture.images[8]


class TestSceneCube:
    def test_hull_contains_the_object_and_is_centred(self, capture):
        points = capture.similarity.apply(surface(2000))
        assert 0.6 < np.abs(points).max() <= 0.75
        # Carved on 64 voxels: nowhere more than a few of them too wide.
        extent = 0.5 * (points.max(0) - points.min(0))
        assert np.abs(extent - 0.75 * RADII).max() < 0.05
        assert np.abs(points.max(0) + points.min(0)).max() < 0.05

    def test_cube_follows_the_world(self, capture, tmp_path):
        """Turning the world's scale and place changes the similarity, not the cameras in the cube."""

        def change(tree):
            for frame in tree["frames"]:
                pose = np.array(frame["transform_matrix"])
                pose[:3, 3] = 100.0 * pose[:3, 3] + [7.0, 8.0, 9.0]
                frame["transform_matrix"] = pose.tolist()

        far = load_capture(write(tmp_path, change=change))
        assert np.allclose(far.poses, capture.poses, atol=1e-4)
        assert np.isclose(far.similarity.scale, 100.0 * capture.similarity.scale, rtol=1e-4)

    def test_another_cube_sees_the_same(self, capture):
        other = capture.within(Similarity(CENTRE + 0.3, 2.5))
        points = surface()
        pixels, _ = capture.project(4, capture.similarity.apply(points))
        again, depth = other.project(4, other.similarity.apply(points))
        assert np.allclose(again, pixels, atol=1e-3)
        assert np.isclose(depth.mean() * 2.5, 4.0, rtol=0.01)  # the camera's distance in the world

    def test_a_wrong_mask_among_many_does_not_shrink_the_cube(self, tmp_path):
        def change(tree):
            image = np.asarray(Image.open(tmp_path / "images" / "007.png")).copy()
            image[:, : SIZE // 2, 3] = 0
            Image.fromarray(image).save(tmp_path / "images" / "007.png")

        loaded = load_capture(write(tmp_path, count=24, change=change))
        assert np.abs(loaded.similarity.apply(surface(2000))).max() <= 0.76

    def test_views_that_cut_the_object_off(self, tmp_path):
        """A close-up says nothing about what is outside of its frame."""

        def change(tree):
            frame = tree["frames"][4]
            pose = look_at(directions(12)[4], distance=1.6)
            Image.fromarray(rgba(ellipsoid_mask(pose))).save(tmp_path / frame["file_path"])
            frame["transform_matrix"] = pose.tolist()

        loaded = load_capture(write(tmp_path, change=change))
        points = loaded.similarity.apply(surface(2000))
        assert 0.6 < np.abs(points).max() <= 0.76


class TestFiles:
    def test_nerf_synthetic_splits_are_merged(self, tmp_path):
        write(tmp_path)
        tree = json.loads((tmp_path / "transforms.json").read_text())
        (tmp_path / "transforms.json").unlink()
        for name, part in (("train", slice(0, 8)), ("val", slice(8, 10)), ("test", slice(10, 12))):
            frames = [f | {"file_path": "./" + f["file_path"][:-4]} for f in tree["frames"][part]]
            angle = 2 * math.atan(0.5 * SIZE / FOCAL)
            (tmp_path / f"transforms_{name}.json").write_text(
                json.dumps({"camera_angle_x": angle, "frames": frames})
            )
        loaded = load_capture(tmp_path)
        assert loaded.names == tuple(f"images/{k:03}.png" for k in range(12))
        assert loaded.name == tmp_path.name

    @pytest.mark.parametrize("place", ["mask_path", "masks/stem", "masks/name"])
    def test_masks_beside_jpeg_images(self, tmp_path, place, capture):
        (tmp_path / "masks").mkdir()

        def change(tree):
            for k, frame in enumerate(tree["frames"]):
                image = Image.open(tmp_path / frame["file_path"])
                image.convert("RGB").save(tmp_path / f"images/{k:03}.jpg")
                (tmp_path / frame["file_path"]).unlink()
                mask = {"mask_path": f"m{k}.png", "masks/stem": f"masks/{k:03}.png"}
                path = tmp_path / mask.get(place, f"masks/{k:03}.jpg.png")
                image.getchannel("A").save(path)
                frame["file_path"] = f"images/{k:03}"
                if place == "mask_path":
                    frame["mask_path"] = path.name

        loaded = load_capture(write(tmp_path, change=change))
        assert loaded.names[3] == "images/003.jpg"
        assert np.array_equal(loaded.images[3][..., 3], capture.images[3][..., 3])
        assert loaded.images[3].dtype == np.uint8

    def test_a_view_given_twice_is_left_out_with_a_warning(self, tmp_path):
        path = write(tmp_path, change=lambda tree: tree["frames"].append(tree["frames"][2]))
        with pytest.warns(CaptureWarning, match=r"images/002.png is the view images/002.png again"):
            assert len(load_capture(path)) == 12

    def test_scaled_axes_are_mended(self, tmp_path, capture):
        def change(tree):
            for frame in tree["frames"]:
                pose = np.array(frame["transform_matrix"])
                pose[:3, :3] *= 1.7
                frame["transform_matrix"] = pose.tolist()

        loaded = load_capture(write(tmp_path, change=change))
        assert np.allclose(loaded.poses, capture.poses, atol=1e-6)
        rotation = loaded.poses[:, :, :3]
        assert np.allclose(rotation @ rotation.transpose(0, 2, 1), np.eye(3), atol=1e-6)


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


def set_alpha(folder, views, alpha):
    for view in views:
        path = folder / "images" / f"{view:03}.png"
        image = Image.open(path)
        image.putalpha(alpha)
        image.save(path)


def assert_refused(folder: Path, words: str, kind: type[Exception] = CaptureError):
    with pytest.raises(kind, match=re.escape(words)) as error:
        load_capture(folder)
    assert "\n" not in str(error.value)


def assert_on_rays(points, origins, rays):
    offset = points - origins
    along = (offset * rays).sum(1, keepdims=True)
    assert (along > 0).all()
    assert np.abs(offset - along * rays).max() < 1e-5


def opencv_pixels(points, pose, lens):
    """Pinhole and lens as OpenCV's manual writes them; (P, 2) pixels and (P,) depth."""
    local = (points - pose[:3, 3]) @ pose[:3, :3] * (1, -1, -1)
    x, y = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
    k1, k2, p1, p2 = lens["k1"], lens["k2"], lens["p1"], lens["p2"]
    r2 = x**2 + y**2
    u = x * (1 + k1 * r2 + k2 * r2**2) + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * (1 + k1 * r2 + k2 * r2**2) + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.stack([FOCAL * u + SIZE / 2, FOCAL * v + SIZE / 2], axis=1), local[:, 2]
