"""Distances of sets of patches."""

import numpy as np
import pytest
import torch
from torch.nn.functional import normalize

from mitex.errors import ImageError
from mitex.evaluation.likeness import exemplar_patches, likeness, patch_features
from mitex.evaluation.metrics import single_image_frechet
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.losses import gram_loss

SIDE = 48
ALL = np.ones((2, SIDE, SIDE), bool)


@pytest.fixture(scope="module")
def images():
    return [Exemplar.load(name).resized(96).maps["albedo"] for name in ("lava", "wicker")]


@pytest.fixture(scope="module")
def features(images):
    """Of lava, of lava at other places, and of wicker."""
    lava, wicker = images
    views = exemplar_patches(lava, ALL), exemplar_patches(lava, ALL, 1), exemplar_patches(wicker, ALL)
    return list(map(patch_features, views))


def test_equal_patches_are_nearest_then_those_of_the_same_texture(features):
    equal, near, far = (likeness(one, features[0]) for one in features)
    assert (equal.frechet_fine, equal.frechet_coarse) == pytest.approx((0, 0), abs=1e-6)
    assert equal.gram == 0 and equal.transport < 0.02  # which compares random vectors
    for name in ("frechet_fine", "frechet_coarse", "transport", "gram"):
        assert getattr(far, name) > 1.5 * getattr(near, name) > 0, name


def test_one_patch_gives_the_distances_of_the_two_images(images):
    """By the functions for whole images, and by the formula of the transport; each at its layers."""
    a, b = (image[:SIDE, :SIDE] for image in images)
    views = [(image[None], np.ones((1, SIDE, SIDE), bool)) for image in (a, b)]
    result = likeness(patch_features(views[0]), patch_features(views[1]))
    assert result.frechet_fine == pytest.approx(single_image_frechet(a, b, "relu2_2"), rel=1e-4)
    assert result.frechet_coarse == pytest.approx(single_image_frechet(a, b, "relu4_1"), rel=1e-4)
    ours, theirs = map(vectors_of, (a, b))
    grams = {k: (v[0].T @ v[0]) / len(v[0]) for k, v in theirs.items()}
    assert result.gram == pytest.approx(float(gram_loss(ours, grams)) / 5, rel=1e-3)


def test_transport_is_the_larger_mean_of_cosine_distances_to_the_nearest(images):
    """MeshNCA, equation 4, summed over five layers; of patches so small that no vector is left out."""
    a, b = (image[:40, :40] for image in images)
    views = [(image[None], np.ones((1, 40, 40), bool)) for image in (a, b)]
    expected = 0.0
    for ours, theirs in zip(vectors_of(a).values(), vectors_of(b).values(), strict=True):
        costs = 1 - normalize(ours[0], dim=1) @ normalize(theirs[0], dim=1).T
        expected += float(max(costs.min(0).values.mean(), costs.min(1).values.mean()))
    result = likeness(patch_features(views[0]), patch_features(views[1]))
    assert result.transport == pytest.approx(expected, rel=1e-4)


def vectors_of(image):
    """(1, n, C) features of an image at the five layers that transport and Gram matrices take."""
    layers = [f"relu{block}_1" for block in (1, 2, 3, 4, 5)]
    maps = Vgg16("max", "float32").features(torch.from_numpy(image[None]), layers)
    return {layer: values.flatten(1, 2) for layer, values in maps.items()}


def test_pixels_that_do_not_count_leave_their_places_out(images):
    mask = ALL[:1].copy()
    mask[:, :, SIDE // 2 :] = False
    patches, masks = exemplar_patches(images[0], mask)
    assert masks is mask and np.ptp(patches[~mask], axis=0).max() == 0
    assert patches[~mask][0] == pytest.approx(patches[mask].mean(0), abs=1e-5)
    features = patch_features((patches, mask))
    assert len(features["relu1_1"]) == SIDE * SIDE // 2
    assert len(features["relu4_1"]) == SIDE * SIDE // 2 // 64
    with pytest.raises(ImageError):
        likeness(patch_features((patches, np.zeros_like(mask))), features)


def test_patches_of_an_exemplar_lie_in_it_and_depend_on_the_seed(images):
    whole, _ = exemplar_patches(images[0], np.ones((2, 96, 96), bool))
    assert np.array_equal(whole[0], images[0]) and np.array_equal(whole[1], images[0])
    first, second = (exemplar_patches(images[0], ALL, seed)[0] for seed in (0, 1))
    assert not np.array_equal(first, second)
    assert np.array_equal(first, exemplar_patches(images[0], ALL)[0])
