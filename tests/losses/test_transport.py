"""Relaxed transport and moments against loops, finite differences, and what they must not depend on."""

import pytest
import torch
import torch.nn.functional as F
from scipy.stats import wasserstein_distance

from mitex.features import normalise_colours
from mitex.losses import channel_transport, moment_distance, relaxed_transport
from mitex.losses.transport import _matches
from tests.losses import authors, brute_force

SIZES = [(1, 1), (7, 5), (5, 7), (13, 13), (33, 64)]


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(11)


def _sets(generator, n, m, channels=3, count=2, dtype=torch.float64):
    def draw(size):
        return torch.rand(count, size, channels, generator=generator, dtype=dtype)

    return draw(n), draw(m)


def _features(generator, n, m, channels, count=2):
    """Vectors as sparse and as alike as those of a network."""
    base = torch.rand(1, 1, channels, generator=generator)

    def draw(size):
        return (base + 0.3 * torch.randn(count, size, channels, generator=generator)).relu()

    return draw(n), draw(m)


@pytest.mark.parametrize("euclidean", [False, True])
@pytest.mark.parametrize(("n", "m"), SIZES)
def test_transport_is_that_of_the_loops(generator, n, m, euclidean):
    a, b = _sets(generator, n, m)
    expected = torch.stack([brute_force.transport(x, y, euclidean) for x, y in zip(a, b, strict=True)])
    assert relaxed_transport(a, b, euclidean).tolist() == pytest.approx(expected.tolist(), rel=1e-6)
    single = relaxed_transport(a.float(), b.float(), euclidean)
    assert single.dtype == torch.float32
    assert single.tolist() == pytest.approx(expected.tolist(), rel=1e-4)


@pytest.mark.parametrize("euclidean", [False, True])
def test_gradients_are_those_of_the_loops(generator, euclidean):
    a, b = (x.requires_grad_() for x in _sets(generator, 9, 12))
    ours = torch.autograd.grad(relaxed_transport(a, b, euclidean).sum(), (a, b))
    pairs = zip(a, b, strict=True)
    loops = torch.stack([brute_force.transport(x, y, euclidean) for x, y in pairs]).sum()
    theirs = torch.autograd.grad(loops, (a, b))
    for ours_part, theirs_part in zip(ours, theirs, strict=True):
        assert torch.allclose(ours_part, theirs_part, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("euclidean", [False, True])
def test_gradients_are_finite_differences(generator, euclidean):
    inputs = tuple(x.requires_grad_() for x in _sets(generator, 6, 4))
    assert torch.autograd.gradcheck(
        lambda a, b: relaxed_transport(a, b, euclidean), inputs, eps=1e-7, atol=1e-5
    )


def test_a_pair_by_hand():
    """Both directions: two vectors of `a` lie on the one of `b`, the third is orthogonal to it."""
    a = torch.tensor([[[1.0, 0.0], [3.0, 0.0], [0.0, 1.0]]])
    b = torch.tensor([[[2.0, 0.0]]])
    assert relaxed_transport(a, b).item() == pytest.approx(1 / 3)
    # Squared distances over 2 channels: 1/2, 1/2 and 5/2; W(b, a) is 0 + 1/2.
    assert relaxed_transport(a, b, euclidean=True).item() == pytest.approx((0.5 + 0.5 + 1 + 2.5) / 3)


def test_the_larger_direction_counts(generator):
    """A set inside another: every vector of the part is matched, not every one of the whole."""
    whole, _ = _sets(generator, 20, 1, channels=8)
    part = whole[:, :5]
    assert relaxed_transport(part, whole).tolist() == relaxed_transport(whole, part).tolist()
    assert (relaxed_transport(part, whole) > 0.01).all()


@pytest.mark.parametrize("low_precision", [False, True])
def test_equal_sets_cost_nothing(generator, low_precision):
    a, _ = _features(generator, 50, 1, 64)
    shuffled = a[:, torch.randperm(50, generator=generator)]
    assert relaxed_transport(a, shuffled, low_precision=low_precision).max() < 1e-5
    colours = a[..., :3]
    assert relaxed_transport(colours, colours, True, low_precision).max() < 1e-5  # the clamp leaves 3e-6
    assert moment_distance(a, shuffled).max() < 1e-5


@pytest.mark.parametrize("euclidean", [False, True])
def test_order_within_a_set_does_not_matter(generator, euclidean):
    a, b = _sets(generator, 15, 11, channels=4)
    p, q = (torch.randperm(k, generator=generator) for k in (15, 11))
    for measure in (lambda a, b: relaxed_transport(a, b, euclidean), moment_distance):
        assert torch.allclose(measure(a, b), measure(a[:, p], b[:, q]))
        assert torch.allclose(measure(a, b), measure(b, a))


def test_pairs_of_a_batch_do_not_touch_each_other(generator):
    a, b = _sets(generator, 9, 8, count=5)
    for measure in (relaxed_transport, moment_distance):
        alone = torch.cat([measure(x[None], y[None]) for x, y in zip(a, b, strict=True)])
        assert torch.allclose(measure(a, b), alone)


def test_length_does_not_matter_to_the_cosine(generator):
    a, b = _sets(generator, 9, 8)
    assert torch.allclose(relaxed_transport(a, b), relaxed_transport(7 * a, 0.3 * b))


def test_zero_vectors_are_at_distance_one(generator):
    """Black pixels, and places where no filter answers."""
    a, b = _sets(generator, 4, 3)
    zero = torch.zeros_like(a).requires_grad_()
    cost = relaxed_transport(zero, b)
    assert cost.tolist() == [1.0, 1.0]
    cost.sum().backward()
    assert zero.grad is not None and zero.grad.isfinite().all()
    assert relaxed_transport(zero, torch.zeros_like(b), euclidean=True).tolist() == pytest.approx(
        [1 + 1e-5 / 3] * 2
    )


def test_far_colours_are_matched(generator):
    """States overflow early in a training: costs far above those of colours in [0, 1]."""
    a, b = _sets(generator, 6, 9)
    a = 40 * a - 20
    expected = torch.stack([brute_force.transport(x, y, True) for x, y in zip(a, b, strict=True)])
    for low_precision in (False, True):
        costs = relaxed_transport(a.float(), b.float(), True, low_precision)
        assert costs.tolist() == pytest.approx(expected.tolist(), rel=1e-4)


@pytest.mark.parametrize(("n", "m", "channels"), [(300, 200, 64), (1024, 1024, 128), (196, 64, 512)])
def test_low_precision_finds_vectors_that_are_as_near(generator, n, m, channels):
    a, b = _features(generator, n, m, channels)
    exact, low = relaxed_transport(a, b), relaxed_transport(a, b, low_precision=True)
    assert low.tolist() == pytest.approx(exact.tolist(), rel=1e-3)
    assert (low >= exact - 1e-6).all()  # another pair can only cost more
    matches, others = _matches(a, b, False, False), _matches(a, b, False, True)
    assert all((x == y).float().mean() > 0.85 for x, y in zip(matches, others, strict=True))


def test_the_search_is_exact_where_costs_differ(generator):
    """Against torch's argmin, in both directions, with a count that is no power of two."""
    a, b = _features(generator, 700, 999, 16)
    cost = 1 - F.normalize(a.double(), dim=-1) @ F.normalize(b.double(), dim=-1).mT
    for match, dim in zip(_matches(a, b, False, False), (2, 1), strict=True):
        picked = cost.gather(dim, match.unsqueeze(dim)).squeeze(dim)
        assert (picked <= cost.amin(dim) * 1.001 + 1e-6).all()
        assert (match == cost.argmin(dim)).float().mean() > 0.99


def test_low_precision_gradient(generator):
    a, b = _features(generator, 400, 400, 64)
    gradients = []
    for low in (False, True):
        x = a.clone().requires_grad_()
        relaxed_transport(x, b, low_precision=low).sum().backward()
        assert x.grad is not None
        gradients.append(x.grad.flatten())
    assert F.cosine_similarity(*gradients, dim=0) > 0.98


def test_moments_are_those_of_the_loops(generator):
    a, b = (x.requires_grad_() for x in _sets(generator, 9, 6, channels=4))
    loops = torch.stack([brute_force.moments(x, y) for x, y in zip(a, b, strict=True)])
    assert torch.allclose(moment_distance(a, b), loops)
    ours = torch.autograd.grad(moment_distance(a, b).sum(), (a, b))
    theirs = torch.autograd.grad(loops.sum(), (a, b))
    assert all(torch.allclose(x, y) for x, y in zip(ours, theirs, strict=True))


def test_covariance_is_unbiased():
    """Of -1, 0, 1 it is 1, of the same numbers twice 4/5, and means agree."""
    a = torch.tensor([[[-1.0], [0.0], [1.0]]])
    assert moment_distance(a, a.repeat(1, 2, 1)).item() == pytest.approx(1 / 5)
    assert moment_distance(a, torch.zeros(1, 4, 1)).item() == pytest.approx(1.0)
    assert moment_distance(a, torch.full((1, 4, 1), 3.0)).item() == pytest.approx(4.0)
    assert moment_distance(torch.ones(1, 1, 2), torch.zeros(1, 1, 2)).item() == pytest.approx(1.0)


def test_moments_are_finite_differences(generator):
    inputs = tuple(x.requires_grad_() for x in _sets(generator, 5, 7))
    assert torch.autograd.gradcheck(moment_distance, inputs, eps=1e-7, atol=1e-5)


def test_moments_in_low_precision(generator):
    a, b = _features(generator, 400, 300, 64)
    results = []
    for low in (False, True):
        x = a.clone().requires_grad_()
        value = moment_distance(x, b, low)
        value.sum().backward()
        assert x.grad is not None
        results.append((value.detach(), x.grad.flatten()))
    (exact, exact_gradient), (low_value, low_gradient) = results
    assert low_value.tolist() == pytest.approx(exact.tolist(), rel=5e-3)
    assert F.cosine_similarity(exact_gradient, low_gradient, dim=0) > 0.99


def test_colours_cost_what_the_authors_compute(generator):
    """Normalised, and without their matrix, which is orthogonal; black, as of a background, among them."""
    a, b = _sets(generator, 40, 30)
    a[:, :20] = 0
    costs = relaxed_transport(normalise_colours(a), normalise_colours(b), euclidean=True)
    expected = [authors.colour_cost(x.numpy(), y.numpy()) for x, y in zip(a, b, strict=True)]
    assert costs.tolist() == pytest.approx(expected, rel=1e-4)


def test_channels_are_transported_exactly(generator):
    """Against SciPy's Wasserstein-1 distance of each channel, and by finite differences."""
    a, b = _sets(generator, 9, 9)
    expected = [
        sum(wasserstein_distance(x[:, c], y[:, c]) for c in range(3)) / 3
        for x, y in zip(a.numpy(), b.numpy(), strict=True)
    ]
    assert channel_transport(a, b).tolist() == pytest.approx(expected)
    inputs = (a.requires_grad_(), b.requires_grad_())
    assert torch.autograd.gradcheck(channel_transport, inputs, eps=1e-7, atol=1e-5)


def test_channel_shares_by_hand():
    """All colours are there on both sides, so the relaxed cost is zero; their shares differ by a half."""
    a = torch.tensor([[[1.0], [1.0], [1.0], [3.0]]])
    b = torch.tensor([[[3.0], [1.0], [3.0], [3.0]]])
    assert channel_transport(a, b).item() == pytest.approx(1.0)
    assert relaxed_transport(a, b, euclidean=True).item() == pytest.approx(1e-5)
