"""Keys of what is kept on disk; `tests/methods/surface/test_cache.py` has the keeping."""

import numpy as np

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
