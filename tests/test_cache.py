"""Keys of what is kept on disk; `tests/methods/surface/test_cache.py` has the keeping."""

import numpy as np
import pytest

from mitex.cache import cached, content_key


def test_keys_follow_the_content():
    a = np.arange(6.0)
    assert content_key(a, 1, "x") == content_key(a.copy(), 1, "x")
    others = [content_key(a.reshape(2, 3), 1, "x"), content_key(a + 1, 1, "x"), content_key(a, 2, "x")]
    others += [content_key(a.astype(np.float32), 1, "x"), content_key(a, 1, "y")]
    assert len({content_key(a, 1, "x"), *others}) == 6


def test_an_empty_file_in_the_cache_is_computed_anew(tmp_path):
    """A power cut may leave one behind."""

    def write(folder, result):
        np.save(folder / "result.npy", result)

    def read(place):
        return np.load(place / "result.npy")

    place = tmp_path / "key"
    place.mkdir()
    (place / "result.npy").touch()
    assert cached(place, lambda: np.ones(1), read, write) == 1
    assert read(place) == 1


class TestDamage:
    """Whatever happens to a result on disk, it is computed again and never shown."""

    @pytest.fixture
    def place(self, tmp_path):
        assert self.get(tmp_path / "key").shape == (64, 3)
        return tmp_path / "key"

    def get(self, place, compute=lambda: np.arange(192).reshape(64, 3)):
        def write(folder, result):
            for k in range(3):
                np.save(folder / f"part{k}.npy", result[:, k])

        def read(place):
            return np.stack([np.load(file) for file in sorted(place.glob("part*.npy"))], axis=1)

        return cached(place, compute, read, write)

    def unread(self):
        raise AssertionError("it was computed again")

    @pytest.mark.parametrize(
        "damage",
        [
            lambda file: file.write_bytes(b""),
            lambda file: file.write_bytes(file.read_bytes()[:-1]),
            lambda file: file.write_bytes(file.read_bytes().replace(b"int64", b"int32", 1)),
            lambda file: file.write_bytes(file.read_bytes()[:-8] + b"\0\0\0\x40\0\0\0\0"),  # 2^30
            lambda file: file.unlink(),  # the last part
            lambda file: file.with_name("part3.npy").write_bytes(file.read_bytes()),
            lambda file: file.with_name("manifest.json").write_text("[]"),
            lambda file: file.with_name("manifest.json").write_text('{"part0.npy": 1}'),
            lambda file: file.with_name("manifest.json").write_text("[" * 100_000),
            lambda file: file.with_name("manifest.json").unlink(),
        ],
        ids=range(10),
    )
    def test_any_damage_shows(self, place, damage):
        assert (self.get(place, self.unread) == np.arange(192).reshape(64, 3)).all()
        damage(place / "part2.npy")
        assert (self.get(place) == np.arange(192).reshape(64, 3)).all()
        assert (self.get(place, self.unread) == np.arange(192).reshape(64, 3)).all()
