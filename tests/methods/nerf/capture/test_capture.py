"""Captures of an ellipsoid whose every ray is known: cameras, scene cube and files."""

import json
import math

import numpy as np
import pytest
from PIL import Image

from mitex.errors import CaptureWarning
from mitex.mesh import Similarity
from mitex.methods.nerf.capture.capture import Capture, load_capture
from tests.methods.nerf.capture.ellipsoid import (
    CENTRE,
    FOCAL,
    RADII,
    SIZE,
    directions,
    ellipsoid_mask,
    look_at,
    rgba,
    surface,
    write,
)


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
