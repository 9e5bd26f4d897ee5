"""Keys that shape the comparison with the exemplar."""

import pytest
import torch

from tests.methods.nca.option_checks.registry import (
    ALL_PLACES,
    appearance_loss,
    only_appearance,
    registry,
    step_loss,
)

CHECKS, check = registry()


@check("order_weight")
def order_counts(build):
    """Of whole maps of relu3_1, at the coarsest zoom."""
    settings = (*ALL_PLACES, "layers=relu1_1,relu3_1", "exemplar_size=256", "target_size=0", "zooms=2")
    none, some = (build(*settings, f"order_weight={weight}") for weight in (0, 5))
    assert [a.ordered for a in none.zooms.values()] == [False, False]
    assert [a.ordered for a in some.zooms.values()] == [True, False]
    views = torch.rand(2, 32, 32, 4, generator=torch.Generator().manual_seed(0))
    values = [t.zooms[128](views, torch.Generator().manual_seed(0)).item() for t in (none, some)]
    assert values[1] > values[0] + 0.1


@check("layers")
def layers_add_up(build):
    losses = [
        appearance_loss(build(*ALL_PLACES, "colour_weight=0", f"layers={layers}"))
        for layers in ("relu1_1", "relu2_1", "relu1_1,relu2_1")
    ]
    assert losses[0] + losses[1] == pytest.approx(losses[2], rel=1e-3)
    assert min(losses) > 0.01


@check("pooling")
def pooling(build):
    views = torch.rand(2, 32, 32, 4, generator=torch.Generator().manual_seed(0))
    average, largest = (
        only_appearance(build(*ALL_PLACES, f"pooling={pooling}"))(
            views, torch.Generator().manual_seed(0)
        ).item()
        for pooling in ("average", "max")
    )
    assert average != pytest.approx(largest, rel=1e-3)


@check("samples")
def few_samples_are_random(build):
    """All places give one loss, whichever views they come from; few give another for each choice."""
    views = torch.rand(2, 32, 32, 4, generator=torch.Generator().manual_seed(0))
    for samples, same in ((4096, True), (16, False)):
        loss = only_appearance(build(*ALL_PLACES, f"samples={samples}"))
        values = [loss(views, torch.Generator().manual_seed(seed)).item() for seed in (0, 1)]
        assert (values[0] == pytest.approx(values[1], rel=1e-4)) == same


@check("colour_weight", "moment_weight")
def weights_of_terms(build):
    """The loss is affine in either weight, and not constant."""
    for key in ("colour_weight", "moment_weight"):
        zero, one, three = (appearance_loss(build(*ALL_PLACES, f"{key}={weight}")) for weight in (0, 1, 3))
        assert three - one == pytest.approx(2 * (one - zero), rel=1e-2)
        assert one > zero + 0.01


@check("colour_histogram")
def histograms_cost_more(build):
    without, with_ = (
        appearance_loss(build(*ALL_PLACES, f"colour_histogram={on}")) for on in ("false", "true")
    )
    assert with_ > without + 0.01


@check("appearance_weight", "overflow_weight")
def weights_of_parts(build):
    one, three = (
        build(*ALL_PLACES, f"appearance_weight={weight}", f"overflow_weight={10 * weight}")
        for weight in (1, 3)
    )
    for task in (one, three):
        task.pool.fill_(2.0)
    (total, parts), (total_3, parts_3) = step_loss(one), step_loss(three)
    assert parts_3["appearance"] == pytest.approx(3 * parts["appearance"], rel=1e-3)
    assert parts["overflow"] > 0.5
    assert total.item() == pytest.approx(parts["appearance"] + 10 * parts["overflow"], rel=1e-4)
    assert total_3.item() == pytest.approx(parts_3["appearance"] + 30 * parts_3["overflow"], rel=1e-4)
