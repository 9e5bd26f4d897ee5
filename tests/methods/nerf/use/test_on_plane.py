"""A texture and a flat picture on planes, compared with photos at ever flatter angles."""

from __future__ import annotations

import numpy as np

from mitex.evaluation import elevations
from mitex.evaluation.metrics import single_image_frechet
from mitex.methods.baselines.quilted.elevations import FLAT, compare_elevations
from tests.methods.nerf.tiny import tiny_capture


def test_elevations_compare_what_photos_show(texture, monkeypatch):
    photos, masks, distances = tiny_capture(side=160, spp=4), [], []

    def distance(image, photo, mask_a, mask_b):
        masks.append((mask_a, mask_b))
        distances.append(single_image_frechet(image, photo, mask_a=mask_a, mask_b=mask_b))
        return distances[-1]

    monkeypatch.setattr(elevations, "single_image_frechet", distance)
    table = compare_elevations(texture, photos, size=256, patches=8, window=64, places=1, syntheses=2)
    assert [row.angle for row in table][:3] == [0, 20, 40]
    count = 1 + len(FLAT)  # ours and flat ones, in each synthesis; before, by angle, captured and photos
    known = np.reshape(distances[: 2 * len(table)], (len(table), 2))
    each = np.reshape(distances[2 * len(table) :], (2, len(table), count))
    for row, (captured, others), row_distances in zip(table, known, each.swapaxes(0, 1), strict=True):
        assert np.isfinite(row_distances).all() and min(row_distances.min(), captured, others) > 0
        assert np.allclose((row.captured, row.photos), (captured, others), rtol=1e-3)
        assert np.allclose((row.ours, *row.flat.values()), row_distances.mean(0), rtol=1e-3)
        assert list(row.flat) == list(FLAT)
        assert (row_distances[0] != row_distances[1]).all()  # the second synthesis is another one
        # Every option shows, but of few patches an even quilt may be the plain one in one synthesis's window.
        values = [len({captured, others, *one}) for one in row_distances]
        assert max(values) == count + 2 and min(values) >= count + 1
        assert row.captured < row.ours or row.angle > 40
        assert row.picture.shape == (4 * 64, 64, 3)
    for k, (mask, photo) in enumerate(masks):
        if k >= 2 * len(table) or k % 2 == 0:  # but for other photos: only pixels that count in both
            assert mask.any() and not (mask & ~photo).any()
    # Seen from above, a plane fills its windows; seen flat, there is but one colour above its horizon.
    flat = [np.diff(np.split(row.picture, 4)[3], axis=0) for row in table]
    even = [(change == 0).all(2).mean() for change in flat]
    assert even[0] < 0.1 and even[-1] > 0.2
