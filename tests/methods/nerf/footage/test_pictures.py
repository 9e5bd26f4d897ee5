"""Videos and folders of photos, read as pictures."""

import numpy as np
import pytest
from PIL import Image

from mitex.errors import CaptureError
from mitex.methods.nerf.footage.pictures import footage
from tests.methods.nerf.footage.films import write_film, write_hdr_film, write_photos

LEVEL = np.full((48, 96, 3), 60, np.uint8)
LEVEL[:, :24] = (200, 40, 40)  # red on the left
PICTURES = [LEVEL + np.uint8(10 * k) for k in range(6)]


def test_frames_of_a_video_come_one_by_one(tmp_path):
    film = footage(write_film(tmp_path / "a.mp4", PICTURES), 400)
    read = list(film.read())
    assert film.video and film.count == len(read) == 6
    assert [picture.name for picture in read] == [f"{k:05}" for k in range(6)]
    for picture, truth in zip(read, PICTURES, strict=True):
        assert np.abs(picture.pixels[:, 30:].astype(int) - truth[:, 30:]).max() < 6
    assert next(film.read()).name == "00000"  # nothing is left running when nobody reads on


def test_a_video_that_a_phone_held_upright_took(tmp_path):
    """It is stored lying, with a note to turn it: the red part, left as stored, is then below."""
    (first, *_) = footage(write_film(tmp_path / "a.mp4", PICTURES, rotation=90), 400).read()
    assert first.pixels.shape == (96, 48, 3)
    assert first.pixels[80, 24, 0] > 150 and first.pixels[10, 24, 0] < 100


@pytest.mark.parametrize("transfer", ["arib-std-b67", "smpte2084"])
def test_hdr_videos_get_the_colours_of_others(tmp_path, transfer):
    """HLG and PQ, as phones film: colours come back, but for the brightest, which are compressed."""
    colours = [(30, 30, 30), (90, 90, 90), (128, 128, 128), (150, 60, 50), (60, 140, 70), (245, 245, 245)]
    picture = np.repeat(np.array(colours, np.uint8), 16, axis=0)[None].repeat(64, axis=0)
    (first, *_) = footage(write_hdr_film(tmp_path / "a.mp4", [picture] * 3, transfer), 400).read()
    patches = np.stack([first.pixels[20:44, 16 * k + 4 : 16 * k + 12].mean((0, 1)) for k in range(6)])
    assert np.abs(patches[:-1] - colours[:-1]).max() < 6 and 200 < patches[-1].mean() < 245


def test_pictures_are_scaled_down_but_not_up(tmp_path):
    film, photos = write_film(tmp_path / "a.mp4", PICTURES), write_photos(tmp_path / "photos", PICTURES)
    for source in (film, photos):
        assert next(footage(source, 48).read()).pixels.shape == (24, 48, 3)
        assert next(footage(source, 400).read()).pixels.shape == (48, 96, 3)


def test_photos_come_by_name_and_upright(tmp_path):
    write_photos(tmp_path / "in" / "images", PICTURES)
    turned = Image.fromarray(LEVEL)
    exif = turned.getexif()
    exif[0x0112] = 6  # stored lying, to be turned clockwise
    turned.save(tmp_path / "in" / "images" / "a.jpg", exif=exif)
    photos = footage(tmp_path / "in", 400)
    assert not photos.video and photos.count == 7
    first, second, *_ = photos.read()
    assert (first.name, second.name) == ("a", "p00")
    assert first.pixels.shape == (96, 48, 3) and first.pixels[5, 24, 0] > 150


def test_a_video_that_ends_early_gives_what_there_is(tmp_path):
    path = write_film(tmp_path / "a.mkv", PICTURES * 20)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    film = footage(path, 400)
    assert 0 < len(list(film.read())) < 120


def test_two_photos_of_one_name(tmp_path):
    write_photos(tmp_path / "in", PICTURES)
    Image.fromarray(LEVEL).save(tmp_path / "in" / "p00.png")
    with pytest.raises(CaptureError, match="two photos named p00"):
        footage(tmp_path / "in", 400)
