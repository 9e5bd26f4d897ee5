"""The frozen stack against the same operations under autograd."""

import weakref

import pytest
import torch
import torch.nn.functional as F

from mitex.features.frozen import FrozenConv, FrozenStack, Pool, Tap
from tests.features.reference import cosine, relative_error

SIZES = [(8, 8), (9, 7), (5, 12)]


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(3)


def _images(generator, height=9, width=7, count=2, channels=3):
    x = torch.randn(count, channels, height, width, generator=generator)
    return x.contiguous(memory_format=torch.channels_last)


def _weights(generator, inputs, outputs):
    return (
        torch.randn(outputs, inputs, 3, 3, generator=generator) * (2 / (9 * inputs)) ** 0.5,
        0.2 * torch.randn(outputs, generator=generator),
    )


def _network(generator, pool, dtype=torch.float32, all_open=False):
    """conv, conv, pool, conv: as frozen operations and as a plain function that returns all outputs."""
    parts = [_weights(generator, i, o) for i, o in ((3, 8), (8, 6), (6, 10))]
    if all_open:
        parts = [(w.abs(), b + 20) for w, b in parts]
    convs = [FrozenConv(w, b, dtype, dtype) for w, b in parts]

    def plain(x):
        first, second, third = (lambda x, p=p: torch.relu(F.conv2d(x, *p, padding=1)) for p in parts)
        one = first(x)
        two = second(one)
        three = F.avg_pool2d(two, 2) if pool == "average" else F.max_pool2d(two, 2)
        return [one, two, three, third(three)]

    return [convs[0], convs[1], Pool(pool), convs[2]], plain


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("pool", ["average", "max"])
def test_outputs_and_gradient_are_those_of_autograd(generator, pool, size):
    operations, plain = _network(generator, pool)
    x = _images(generator, *size).requires_grad_()
    outputs = FrozenStack.apply(x, operations, [Tap(i) for i in range(4)])
    expected = plain(x)
    upstream = [torch.randn(e.shape, generator=generator) for e in expected]
    for output, reference in zip(outputs, expected, strict=True):
        assert relative_error(output, reference) < 1e-6
    ours = torch.autograd.grad(outputs, x, upstream)[0]
    theirs = torch.autograd.grad(expected, x, upstream)[0]
    assert relative_error(ours, theirs) < 1e-6


@pytest.mark.parametrize("pool", ["average", "max"])
def test_each_tap_alone(generator, pool):
    """The gradient starts at the deepest tap that has one, wherever it is."""
    operations, plain = _network(generator, pool)
    x = _images(generator).requires_grad_()
    for index in range(4):
        outputs = FrozenStack.apply(x, operations, [Tap(i) for i in range(4)])
        upstream = torch.randn(outputs[index].shape, generator=generator)
        ours = torch.autograd.grad(outputs[index], x, upstream)[0]
        theirs = torch.autograd.grad(plain(x)[index], x, upstream)[0]
        assert relative_error(ours, theirs) < 1e-6


@pytest.mark.parametrize(("all_open", "least"), [(False, 0.996), (True, 0.99999)])
def test_bfloat16_stack(generator, all_open, least):
    """What little the gradient loses, it loses to ReLUs that rounding opens or shuts."""
    operations, plain = _network(generator, "average", torch.bfloat16, all_open)
    x = _images(generator, 12, 12).bfloat16().float().requires_grad_()
    output = FrozenStack.apply(x.bfloat16(), operations, [Tap(3)])[0]
    expected = plain(x)[3]
    assert output.dtype == torch.float32
    assert relative_error(output, expected) < 1e-2
    upstream = torch.randn(expected.shape, generator=generator)
    ours = torch.autograd.grad(output, x, upstream)[0]
    assert cosine(ours, torch.autograd.grad(expected, x, upstream)[0]) > least


def test_sampled_taps_are_places_of_whole_ones(generator):
    operations, _ = _network(generator, "average")
    x = _images(generator)
    for index, places in ((1, 63), (3, 12)):
        where = torch.stack([torch.randperm(places, generator=generator)[:7] for _ in range(2)])
        whole, sampled = FrozenStack.apply(x, operations, [Tap(index), Tap(index, where)])
        expected = whole.flatten(2).gather(2, where[:, None].expand(-1, whole.shape[1], -1)).mT
        assert torch.equal(sampled, expected)


def test_taps_of_one_layer_add_up(generator):
    """Two samplings, one of them with a place twice, and the whole map: gradients add."""
    operations, _ = _network(generator, "max")
    x = _images(generator).requires_grad_()
    one = torch.tensor([[0, 5, 5, 62], [1, 1, 1, 7]])
    two = torch.tensor([[5, 40], [7, 0]])
    taps = [Tap(1, one), Tap(1), Tap(1, two)]
    together = FrozenStack.apply(x, operations, taps)
    upstream = [torch.randn(o.shape, generator=generator) for o in together]
    total = torch.autograd.grad(together, x, upstream)[0]
    # The ReLU's mask is the same for all of them, so that the upstream gradients themselves may be added up.
    dense = upstream[1].clone()
    for where, p in ((one, upstream[0]), (two, upstream[2])):
        for k in range(2):
            for n, place in enumerate(where[k].tolist()):
                dense[k, :, place // 7, place % 7] += p[k, n]
    whole = FrozenStack.apply(x, operations, [Tap(1)])[0]
    assert relative_error(total, torch.autograd.grad(whole, x, dense)[0]) < 1e-6


def test_operations_after_the_last_tap_do_not_matter(generator):
    operations, plain = _network(generator, "average")
    x = _images(generator).requires_grad_()
    output = FrozenStack.apply(x, operations, [Tap(1)])[0]
    ours = torch.autograd.grad(output.square().sum(), x)[0]
    assert relative_error(ours, torch.autograd.grad(plain(x)[1].square().sum(), x)[0]) < 1e-6


def test_max_pool_breaks_ties_as_torch_does():
    x = torch.ones(1, 3, 4, 4)
    upstream = torch.arange(12.0).view(1, 3, 2, 2)
    expected = x.clone().requires_grad_()
    F.max_pool2d(expected, 2).backward(upstream)
    assert expected.grad is not None
    assert torch.equal(Pool("max").backward(upstream, x), expected.grad)


def test_returned_maps_belong_to_the_caller(generator):
    operations, plain = _network(generator, "average")
    x = _images(generator).requires_grad_()
    output = FrozenStack.apply(x, operations, [Tap(0)])[0]
    upstream = torch.randn(output.shape, generator=generator)
    with torch.no_grad():
        output.zero_()
    ours = torch.autograd.grad(output, x, upstream)[0]
    assert relative_error(ours, torch.autograd.grad(plain(x)[0], x, upstream)[0]) < 1e-6


def test_maps_are_freed_without_a_backward_pass(generator):
    operations, _ = _network(generator, "average")
    output = FrozenStack.apply(_images(generator).requires_grad_(), operations, [Tap(3)])[0]
    gone = weakref.ref(output)
    del output
    assert gone() is None


def test_no_gradient_is_asked_for(generator):
    operations, _ = _network(generator, "average")
    assert not FrozenStack.apply(_images(generator), operations, [Tap(3)])[0].requires_grad


def test_a_second_backward_pass_says_so(generator):
    operations, _ = _network(generator, "average")
    x = _images(generator).requires_grad_()
    loss = FrozenStack.apply(x, operations, [Tap(3)])[0].sum()
    loss.backward(retain_graph=True)
    with pytest.raises(RuntimeError, match="one backward pass"):
        loss.backward()


def test_second_derivatives_are_refused(generator):
    operations, _ = _network(generator, "average")
    x = _images(generator).requires_grad_()
    loss = FrozenStack.apply(x, operations, [Tap(3)])[0].square().sum()
    slope = torch.autograd.grad(loss, x, create_graph=True)[0]
    with pytest.raises(RuntimeError, match="once_differentiable"):
        slope.sum().backward()
