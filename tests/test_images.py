"""Reading images of every right and wrong kind, and writing them."""

import errno
import os
import struct
import tracemalloc
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from mitex.errors import ImageError, OutputError
from mitex.images import read_bytes, read_image, resize, to_bytes, write_image


def pixels(height=5, width=7, channels=3, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (height, width, channels), np.uint8)


def png_claiming(width, height, depth=8, kind=2):
    """A tiny PNG whose header claims any size."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)
    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 100)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + data


def assert_refused(path, *words, **options):
    with pytest.raises(ImageError) as error:
        read_image(path, **options)
    message = str(error.value)
    assert "\n" not in message
    assert "; " in message and error.value.remedy
    for word in words:
        assert word in message
    return message


class TestReads:
    def test_rgb_as_stored(self, tmp_path):
        data = pixels()
        Image.fromarray(data).save(tmp_path / "a.png")
        image = read_image(tmp_path / "a.png")
        assert image.dtype == np.float32 and image.flags.writeable
        np.testing.assert_array_equal(image, data.astype(np.float32) / np.float32(255))

    def test_grey_becomes_three_equal_channels_or_one(self, tmp_path):
        data = pixels(channels=1)[:, :, 0]
        Image.fromarray(data).save(tmp_path / "a.png")
        expected = data[:, :, None] / np.float32(255)
        rgb = read_image(tmp_path / "a.png")
        np.testing.assert_array_equal(rgb, np.repeat(expected, 3, 2))
        assert rgb.flags.writeable
        np.testing.assert_array_equal(read_image(tmp_path / "a.png", "L"), expected)

    def test_grey_stored_as_rgb_becomes_the_same_one_channel(self, tmp_path):
        data = pixels(channels=1)[:, :, 0]
        Image.fromarray(np.repeat(data[:, :, None], 3, 2)).save(tmp_path / "a.png")
        np.testing.assert_allclose(read_image(tmp_path / "a.png", "L")[:, :, 0], data / 255.0, atol=1e-7)

    def test_16_bit_grey_keeps_its_precision(self, tmp_path):
        data = np.array([[0, 1, 257], [300, 40_000, 65_535]], np.uint16)
        Image.fromarray(data).save(tmp_path / "a.png")
        image = read_image(tmp_path / "a.png", "L")
        np.testing.assert_allclose(image[:, :, 0], data / 65535.0, rtol=1e-6)

    def test_palette(self, tmp_path):
        data = np.zeros((4, 4, 3), np.uint8)
        data[1:, :, 0], data[2:, :, 1] = 200, 90
        Image.fromarray(data).convert("P", palette=Image.Palette.ADAPTIVE).save(tmp_path / "a.png")
        np.testing.assert_array_equal(np.round(read_image(tmp_path / "a.png") * 255), data)

    def test_one_bit(self, tmp_path):
        Image.fromarray(np.array([[0, 255], [255, 0]], np.uint8)).convert("1").save(tmp_path / "a.png")
        np.testing.assert_array_equal(read_image(tmp_path / "a.png", "L")[:, :, 0], [[0, 1], [1, 0]])

    def test_opaque_alpha_is_dropped(self, tmp_path):
        data = np.dstack([pixels(), np.full((5, 7, 1), 255, np.uint8)])
        Image.fromarray(data).save(tmp_path / "a.png")
        np.testing.assert_array_equal(np.round(read_image(tmp_path / "a.png") * 255), data[:, :, :3])

    def test_cmyk_jpeg(self, tmp_path):
        red = np.zeros((8, 8, 4), np.uint8)
        red[:, :, 1:3] = 255
        Image.fromarray(red, "CMYK").save(tmp_path / "a.jpg", quality=95)
        np.testing.assert_allclose(read_image(tmp_path / "a.jpg").mean((0, 1)), [1, 0, 0], atol=0.03)

    def test_camera_orientation_is_obeyed(self, tmp_path):
        exif = Image.Exif()
        exif[0x0112] = 6
        Image.fromarray(pixels(8, 16)).save(tmp_path / "a.jpg", exif=exif)
        assert read_image(tmp_path / "a.jpg").shape == (16, 8, 3)

    def test_content_counts_not_the_name(self, tmp_path):
        Image.fromarray(pixels()).save(tmp_path / "a.jpg", format="PNG")
        assert read_image(tmp_path / "a.jpg").shape == (5, 7, 3)


class TestBytes:
    def test_as_stored_with_and_without_alpha(self, tmp_path):
        for channels in (3, 4):
            data = pixels(channels=channels)
            Image.fromarray(data).save(tmp_path / "a.png")
            image = read_bytes(tmp_path / "a.png")
            assert image.dtype == np.uint8 and np.array_equal(image, data)

    def test_grey_and_16_bit_grey(self, tmp_path):
        grey = pixels(channels=1)[:, :, 0]
        for stored in (grey, grey.astype(np.uint16) * 257):
            Image.fromarray(stored).save(tmp_path / "a.png")
            assert np.array_equal(read_bytes(tmp_path / "a.png"), grey[:, :, None].repeat(3, axis=2))

    def test_damaged(self, tmp_path):
        path = tmp_path / "a.png"
        Image.fromarray(pixels(40, 40)).save(path)
        path.write_bytes(path.read_bytes()[:-600])
        with pytest.raises(ImageError, match="damaged or cut short"):
            read_bytes(path)


class TestRefuses:
    def test_missing_folder_and_empty(self, tmp_path):
        assert_refused(tmp_path / "no.png", "does not exist")
        assert_refused(tmp_path, "is a folder")
        (tmp_path / "a.png").touch()
        assert_refused(tmp_path / "a.png", "is empty")
        assert_refused(tmp_path / ("x" * 300 + ".png"), "does not exist")

    def test_devices_and_pipes(self, tmp_path):
        os.mkfifo(tmp_path / "pipe.png")
        assert_refused(tmp_path / "pipe.png", "not a regular file")

    @pytest.mark.parametrize(
        ("kind", "word"), [("GIF", "GIF"), ("TIFF", "TIFF"), ("WEBP", "WebP"), ("BMP", "BMP")]
    )
    def test_other_kinds_renamed(self, tmp_path, kind, word):
        Image.fromarray(pixels()).save(tmp_path / "a.png", format=kind)
        assert_refused(tmp_path / "a.png", word, "give a PNG or JPEG")

    @pytest.mark.parametrize("content", [b"hello", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\0" * 999])
    def test_text_and_damaged_headers(self, tmp_path, content):
        (tmp_path / "a.png").write_bytes(content)
        assert_refused(tmp_path / "a.png")

    def test_animated(self, tmp_path):
        frames = [Image.fromarray(pixels(seed=s)) for s in range(3)]
        frames[0].save(tmp_path / "a.png", save_all=True, append_images=frames[1:])
        assert_refused(tmp_path / "a.png", "animated")

    def test_transparent(self, tmp_path):
        data = np.dstack([pixels(), np.full((5, 7, 1), 255, np.uint8)])
        data[2, 3, 3] = 0
        Image.fromarray(data).save(tmp_path / "a.png")
        assert_refused(tmp_path / "a.png", "transparent", "flatten")

    @pytest.mark.parametrize("size", [(50_000, 50_000), (20_000, 5_000), (12_000, 8_000), (2**31 - 1, 1)])
    def test_huge_header_costs_nothing(self, tmp_path, size):
        (tmp_path / "a.png").write_bytes(png_claiming(*size))
        tracemalloc.start()
        assert_refused(tmp_path / "a.png", "over the limit of 64 megapixels")
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 2e6

    def test_huge_jpeg_header(self, tmp_path):
        Image.fromarray(pixels(8, 8)).save(tmp_path / "a.jpg")
        data = bytearray((tmp_path / "a.jpg").read_bytes())
        at = data.index(b"\xff\xc0") + 5
        data[at : at + 4] = struct.pack(">HH", 65_000, 65_000)
        (tmp_path / "a.jpg").write_bytes(data)
        assert_refused(tmp_path / "a.jpg", "over the limit")

    def test_budget_is_an_option(self, tmp_path):
        Image.fromarray(pixels()).save(tmp_path / "a.png")
        assert read_image(tmp_path / "a.png", max_pixels=35).shape == (5, 7, 3)
        assert_refused(tmp_path / "a.png", "limit of 34 pixels", max_pixels=34)

    @pytest.mark.parametrize("size", [(0, 10), (10, 0)])
    def test_zero_size(self, tmp_path, size):
        (tmp_path / "a.png").write_bytes(png_claiming(*size))
        assert_refused(tmp_path / "a.png")

    def test_less_data_than_the_header_says(self, tmp_path):
        (tmp_path / "a.png").write_bytes(png_claiming(400, 400))
        assert_refused(tmp_path / "a.png", "damaged or cut short")

    def test_text_chunk_bomb(self, tmp_path):
        bomb = zlib.compress(b"x" * 80_000_000, 9)
        body = b"Comment\0\0" + bomb
        chunk = struct.pack(">I", len(body)) + b"zTXt" + body + struct.pack(">I", zlib.crc32(b"zTXt" + body))
        whole = png_claiming(16, 16)
        (tmp_path / "a.png").write_bytes(whole[:33] + chunk + whole[33:])
        assert_refused(tmp_path / "a.png")

    @pytest.mark.parametrize("suffix", [".png", ".jpg"])
    def test_truncated_anywhere(self, tmp_path, suffix):
        Image.fromarray(pixels(40, 40)).save(tmp_path / f"a{suffix}")
        data = (tmp_path / f"a{suffix}").read_bytes()
        for share in (0.02, 0.1, 0.3, 0.6, 0.9):
            (tmp_path / "cut").write_bytes(data[: int(len(data) * share)])
            assert_refused(tmp_path / "cut")

    @settings(max_examples=60, deadline=None)
    @given(at=st.integers(0, 3000), value=st.integers(0, 255), kind=st.sampled_from(["PNG", "JPEG"]))
    def test_a_flipped_byte_is_read_or_refused(self, tmp_path_factory, at, value, kind):
        """Never another exception."""
        folder = tmp_path_factory.mktemp("flip")
        Image.fromarray(pixels(24, 24)).save(folder / "a", format=kind)
        data = bytearray((folder / "a").read_bytes())
        data[at % len(data)] = value
        (folder / "a").write_bytes(data)
        try:
            image = read_image(folder / "a")
        except ImageError:
            return
        assert np.isfinite(image).all() and image.min() >= 0 and image.max() <= 1


class TestWrites:
    @pytest.mark.parametrize("shape", [(4, 5), (4, 5, 1), (4, 5, 3)])
    def test_png_round_trip(self, tmp_path, shape):
        data = np.random.default_rng(1).integers(0, 256, shape) / 255.0
        path = write_image(tmp_path / "new" / "a.png", data)
        mode = "RGB" if len(shape) == 3 and shape[2] == 3 else "L"
        np.testing.assert_allclose(read_image(path, mode).reshape(shape), data, atol=1e-6)

    def test_clips_and_rounds(self, tmp_path):
        path = write_image(tmp_path / "a.png", np.array([[-1.0, 2.0, 0.5019]]))
        np.testing.assert_array_equal(read_image(path, "L")[0, :, 0] * 255, [0, 255, 128])

    def test_jpeg(self, tmp_path):
        path = write_image(tmp_path / "a.jpg", np.full((16, 16, 3), 0.25))
        np.testing.assert_allclose(read_image(path), 0.25, atol=0.01)

    def test_refuses(self, tmp_path):
        with pytest.raises(OutputError):
            write_image(tmp_path / "a.gif", np.zeros((4, 4)))
        for bad in (np.zeros(3), np.zeros((2, 2, 2)), np.zeros((0, 4, 3)), np.array([[np.nan]])):
            with pytest.raises(ImageError):
                write_image(tmp_path / "a.png", bad)
        assert not list(tmp_path.iterdir())

    def test_a_full_disk_leaves_the_old_file(self, tmp_path, monkeypatch):
        path = write_image(tmp_path / "a.png", np.zeros((4, 4)))
        before = path.read_bytes()

        def full(*_):
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(OutputError, match="space"):
            write_image(path, np.ones((4, 4)))
        assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["a.png"]


class TestResize:
    def test_is_antialiased(self):
        stripes = np.tile(np.array([0.0, 1.0], np.float32), (64, 32))[:, :, None]
        np.testing.assert_allclose(resize(stripes, 16, 16)[2:-2, 2:-2], 0.5, atol=0.05)

    def test_keeps_constants_and_range(self):
        np.testing.assert_allclose(resize(np.full((9, 5, 2), 0.3, np.float32), 40, 3), 0.3, atol=1e-6)
        edge = (np.arange(16) > 7).astype(np.float32)[None, :, None].repeat(16, 0)
        assert resize(edge, 50, 50).min() >= 0 and resize(edge, 50, 50).max() <= 1

    def test_orientation(self):
        ramp = np.linspace(0, 1, 8, dtype=np.float32)[:, None, None].repeat(8, 1)
        small = resize(ramp, 4, 8)
        assert (np.diff(small[:, 0, 0]) > 0.1).all() and np.ptp(small[0]) < 1e-6


def test_bytes_are_rounded_and_clipped():
    values = np.array([-0.2, 0.0, 0.4 / 255, 0.6 / 255, 0.5, 1.0, 1.2], np.float32)
    assert to_bytes(values).tolist() == [0, 0, 0, 1, 128, 255, 255] and to_bytes(values).dtype == np.uint8
