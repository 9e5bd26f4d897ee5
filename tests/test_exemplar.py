"""Exemplars from images, folders of any content, and names."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitex import exemplar
from mitex.errors import ImageError
from mitex.exemplar import DATA, MAPS, Exemplar, map_of
from mitex.images import read_image, write_image

EMBEDDED = DATA / "cobblestone" / "normal.png"


def save(path: Path, value: int | tuple[int, ...] = 128, size=(32, 32), mode="RGB"):
    """A flat image; size is (width, height)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new(mode, size, value if mode == "L" or isinstance(value, tuple) else (value,) * 3).save(path)


def assert_refused(path, *words):
    with pytest.raises(ImageError) as error:
        Exemplar.load(path)
    for word in words:
        assert word in str(error.value)
    assert error.value.remedy


class TestNames:
    @pytest.mark.parametrize(
        ("file", "name"),
        [
            ("albedo.png", "albedo"),
            ("basecolor.jpg", "albedo"),
            ("Base_Color.PNG", "albedo"),
            ("Bricks076_1K-PNG_Color.png", "albedo"),
            ("brick_wall_diff_2k.jpg", "albedo"),
            ("ambient_occlusion.png", "ambient_occlusion"),
            ("Waffle_001_ambientOcclusion.jpg", "ambient_occlusion"),
            ("wall-AO.png", "ambient_occlusion"),
            ("rock_disp_4k.png", "height"),
            ("Rock_Displacement.png", "height"),
            ("normal.png", "normal"),
            ("Bricks_1K_NormalGL.jpg", "normal"),
            ("wall_nor_gl_1k.png", "normal"),
            ("Bricks_1K_NormalDX.jpg", "normal_dx"),
            ("wall_nor_dx_1k.png", "normal_dx"),
            ("my roughness.png", "roughness"),
            ("albedo_1024.png", "albedo"),
            ("preview.png", None),
            ("metallic.png", None),
            ("chaos.png", None),
            ("123.png", None),
        ],
    )
    def test_map_of(self, file, name):
        assert map_of(Path(file)) == name


class TestLoad:
    def test_an_image_is_the_albedo(self, tmp_path):
        save(tmp_path / "moss.png", (255, 0, 51))
        loaded = Exemplar.load(tmp_path / "moss.png")
        assert loaded.name == "moss" and list(loaded.maps) == ["albedo"] and loaded.size == (32, 32)
        np.testing.assert_allclose(loaded.maps["albedo"][3, 4], [1, 0, 0.2], atol=1e-6)

    def test_a_path_below_home(self, tmp_path, monkeypatch):
        monkeypatch.setenv("HOME", str(tmp_path))
        save(tmp_path / "moss.png", (255, 0, 51))
        assert Exemplar.load("~/moss.png").name == "moss"

    @pytest.mark.parametrize("names", [["height"], ["albedo", "roughness"], list(MAPS)])
    def test_any_subset(self, tmp_path, names):
        for name in names:
            save(tmp_path / "set" / f"{name}.png", (128, 128, 255) if name == "normal" else 100)
        save(tmp_path / "set" / "preview.png", 5, (99, 7))
        (tmp_path / "set" / "notes.txt").write_text("hello")
        (tmp_path / "set" / ".albedo.png").write_text("a hidden file is nobody's map")
        loaded = Exemplar.load(str(tmp_path / "set"))
        assert loaded.name == "set" and list(loaded.maps) == sorted(names)
        for name, array in loaded.maps.items():
            assert array.shape == (32, 32, MAPS[name]) and array.dtype == np.float32

    def test_height_stored_as_rgb_or_grey(self, tmp_path):
        save(tmp_path / "a" / "height.png", 60, mode="RGB")
        save(tmp_path / "b" / "height.png", 60, mode="L")
        a, b = (Exemplar.load(tmp_path / k).maps["height"] for k in "ab")
        assert a.shape == (32, 32, 1)
        np.testing.assert_allclose(a, b, atol=1e-7)

    def test_sizes_follow_the_albedo(self, tmp_path):
        save(tmp_path / "albedo.png", 90, (48, 24))
        save(tmp_path / "roughness.png", 30, (96, 48))
        maps = Exemplar.load(tmp_path).maps
        assert maps["roughness"].shape == (24, 48, 1)
        np.testing.assert_allclose(maps["roughness"], 30 / 255, atol=1e-6)

    def test_directx_normals_are_turned(self, tmp_path):
        save(tmp_path / "x_NormalDX.png", (128, 200, 230))
        turned = Exemplar.load(tmp_path).maps["normal"]
        np.testing.assert_allclose(turned[0, 0], [128 / 255, 55 / 255, 230 / 255], atol=1e-6)
        save(tmp_path / "x_NormalGL.png", (128, 90, 230))
        np.testing.assert_allclose(Exemplar.load(tmp_path).maps["normal"][0, 0, 1], 90 / 255, atol=1e-6)

    def test_shared_sets(self, shared_data):
        folders = sorted((shared_data / "exemplars").iterdir())
        assert folders
        for folder in folders:
            assert set(Exemplar.load(folder).maps) == set(MAPS)


class TestRefuses:
    def test_nothing_there(self, tmp_path):
        assert_refused(tmp_path / "none", "there is no exemplar")
        assert_refused("cobbleston", "did you mean cobblestone?")
        assert_refused("a\0b")
        assert_refused("x" * 5000)

    def test_empty_and_unknown_folders(self, tmp_path):
        assert_refused(tmp_path, "is empty", "albedo.png")
        save(tmp_path / "preview.png")
        assert_refused(tmp_path, "no map that Mitex knows")
        (tmp_path / "albedo.tif").write_bytes(b"II*\0")
        assert_refused(tmp_path, "albedo.tif", "convert")

    def test_contradictory_duplicates(self, tmp_path):
        save(tmp_path / "albedo.png")
        save(tmp_path / "basecolor.jpg")
        assert_refused(tmp_path, "albedo twice", "albedo.png", "basecolor.jpg", "remove one")

    def test_aspect_ratios_that_differ(self, tmp_path):
        save(tmp_path / "albedo.png", size=(32, 32))
        save(tmp_path / "height.png", size=(64, 32))
        assert_refused(tmp_path, "aspect ratio", "64 x 32")

    def test_a_damaged_map(self, tmp_path):
        save(tmp_path / "albedo.png")
        (tmp_path / "ao.png").write_text("not an image")
        assert_refused(tmp_path, "ao.png", "is not an image")

    def test_too_small(self, tmp_path):
        save(tmp_path / "dot.png", size=(300, 15))
        assert_refused(tmp_path / "dot.png", "300 x 15", "at least 16")

    @pytest.mark.parametrize("name", ["normal", "normal_gl", "normal_dx"])
    def test_green_points_up_whatever_the_name_says(self, tmp_path, name):
        true = read_image(EMBEDDED)
        for array in (true, true * np.array([1, -1, 1]) + np.array([0, 1, 0])):
            write_image(tmp_path / f"{name}.png", array)
            np.testing.assert_allclose(Exemplar.load(tmp_path).maps["normal"], true, atol=2 / 255)

    def test_red_and_green_exchanged(self, tmp_path):
        write_image(tmp_path / "normal.png", read_image(EMBEDDED)[..., [1, 0, 2]])
        assert_refused(tmp_path, "red and green", "are exchanged")

    def test_a_normal_map_that_is_none(self, tmp_path):
        save(tmp_path / "normal.png", (200, 100, 20))
        assert_refused(tmp_path, "not a tangent-space normal map")

    @pytest.mark.parametrize(
        "maps",
        [
            {},
            {"metal": np.zeros((16, 16, 1), np.float32)},
            {"height": np.zeros((16, 16, 3), np.float32)},
            {"albedo": np.zeros((16, 16, 3)), "height": np.zeros((16, 17, 1))},
        ],
    )
    def test_direct_construction(self, maps):
        with pytest.raises(ImageError):
            Exemplar(maps)


class TestResized:
    def test_is_the_central_square(self):
        ramp = np.broadcast_to(np.arange(64, dtype=np.float32)[None, :, None] / 64, (32, 64, 1))
        small = Exemplar({"height": ramp}).resized(16).maps["height"]
        assert small.shape == (16, 16, 1)
        np.testing.assert_allclose(
            small[5, 2:-2, 0], ramp[0, 16:48, 0].reshape(16, 2).mean(1)[2:-2], atol=2e-3
        )

    def test_normals_stay_unit(self, rng):
        n = rng.normal(size=(64, 64, 3)) + [0, 0, 2]
        n /= np.linalg.norm(n, axis=2, keepdims=True)
        small = Exemplar({"normal": (n * 0.5 + 0.5).astype(np.float32)}).resized(16).maps["normal"] * 2 - 1
        np.testing.assert_allclose(np.linalg.norm(small, axis=2), 1, atol=1e-5)

    def test_refuses(self):
        with pytest.raises(ImageError):
            Exemplar({"height": np.zeros((16, 16, 1), np.float32)}).resized(0)


class TestEmbedded:
    def test_all_are_full_tileable_sets(self):
        """The step across the border is like any step inside."""
        assert len(exemplar.names()) >= 3
        for name in exemplar.names():
            loaded = Exemplar.load(name)
            assert loaded.name == name and set(loaded.maps) == set(MAPS) and loaded.size == (512, 512)
            for key, array in loaded.maps.items():
                assert array.std() > 0.01, (name, key)
                for axis in (0, 1):
                    inside = np.abs(np.diff(array, axis=axis)).mean(axis=(1 - axis, 2))
                    border = np.abs(array.take(0, axis) - array.take(-1, axis)).mean()
                    assert border <= inside.max() * 1.05, (name, key, axis)

    def test_normals_follow_from_the_height(self):
        """Direction of both slopes, OpenGL: green grows where the surface faces the top of the image."""
        for name in exemplar.names():
            maps = Exemplar.load(name).resized(256).maps
            height, normal = maps["height"][:, :, 0], maps["normal"] * 2 - 1
            dx = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / 2
            up = (np.roll(height, 1, 0) - np.roll(height, -1, 0)) / 2
            for slope, component in ((dx, normal[:, :, 0]), (up, normal[:, :, 1])):
                tangent = component / np.maximum(normal[:, :, 2], 0.1)
                assert np.corrcoef(-slope.ravel(), tangent.ravel())[0, 1] > 0.8, name
            np.testing.assert_allclose(np.linalg.norm(normal, axis=2), 1, atol=0.02)

    def test_license_is_there_and_the_sets_are_small(self):
        assert "CC0" in (exemplar.DATA / "LICENSE").read_text()
        for name in exemplar.names():
            assert sum(p.stat().st_size for p in (exemplar.DATA / name).glob("*.png")) < 1.75e6, name


class TestNormalMaps:
    """What is taken for one: normals around the neutral, whichever of its two bytes is used."""

    @pytest.mark.parametrize("neutral", [127, 128])
    @pytest.mark.parametrize("order", [[2, 1, 0], [0, 2, 1]])
    def test_swapped_channels_are_refused(self, tmp_path, rng, neutral, order):
        bumps = rng.integers(-20, 21, (32, 32, 3))
        pixels = (np.array([neutral, neutral, 250]) + np.minimum(bumps, [20, 20, 5])).astype(np.uint8)
        Image.fromarray(pixels).save(tmp_path / "normal.png")
        Exemplar.load(tmp_path)
        Image.fromarray(pixels[..., order]).save(tmp_path / "normal.png")
        assert_refused(tmp_path, "normal.png", "not a tangent-space normal map")

    def test_heights_are_refused(self, tmp_path, rng):
        grey = rng.integers(60, 256, (32, 32, 1), np.uint8).repeat(3, axis=2)
        Image.fromarray(grey).save(tmp_path / "normal.png")
        assert_refused(tmp_path, "normal.png", "not a tangent-space normal map")


def test_an_exemplar_is_taken_as_it_is_and_a_name_is_loaded():
    bricks = Exemplar.load("bricks")
    assert Exemplar.of(bricks) is bricks and Exemplar.of("bricks").key == bricks.key
