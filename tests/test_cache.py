"""Keys of what is kept on disk; `tests/methods/surface/test_cache.py` has the keeping."""

import numpy as np

from mitex.cache import content_key


def test_keys_follow_the_content():
    a = np.arange(6.0)
    assert content_key(a, 1, "x") == content_key(a.copy(), 1, "x")
    others = [content_key(a.reshape(2, 3), 1, "x"), content_key(a + 1, 1, "x"), content_key(a, 2, "x")]
    others += [content_key(a.astype(np.float32), 1, "x"), content_key(a, 1, "y")]
    assert len({content_key(a, 1, "x"), *others}) == 6
