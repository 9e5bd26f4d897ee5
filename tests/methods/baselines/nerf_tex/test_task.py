"""The loss of a fit to a box, and its settings."""

from __future__ import annotations

from typing import Any

import pytest
import torch

from mitex.errors import ConfigError
from mitex.methods.baselines.nerf_tex import PRESETS, NerfTexConfig, fit
from mitex.methods.baselines.nerf_tex.box import picture_box, possible_cells
from mitex.methods.baselines.nerf_tex.task import BoxTask
from mitex.methods.nerf.training.radiance import Rendered
from mitex.training.config import resolve
from tests.methods.baselines.nerf_tex.small import SMALL


@pytest.mark.parametrize(("loss", "relative"), [("l1", 0.2 / 0.61), ("l2", 5 * (0.2 / 0.61) ** 2)])
def test_colours_are_compared_where_something_is(loss, relative):
    """Relative differences where alpha is above 0, squared ones of the opacity everywhere."""
    colour = torch.tensor([[0.5, 0.2, 0.0], [0.3, 0.3, 0.3]])
    batch: Any = type("Batch", (), {})()
    batch.colours, batch.alpha = (
        torch.tensor([[0.5, 0.4, 0.0], [0.9, 0.9, 0.9]]),
        torch.tensor([[1.0], [0.0]]),
    )
    rendered: Any = object.__new__(Rendered)
    rendered.colour, rendered.transmittance = colour, torch.tensor([0.5, 0.8])
    task = object.__new__(BoxTask)
    task.config = NerfTexConfig(colour_loss=loss)
    error = task.error(rendered, batch, torch.zeros(2, 3))
    assert error.item() == pytest.approx(relative / 3 + (0.5**2 + 0.2**2) / 2)


def first_loss(box, config: NerfTexConfig) -> float:
    pictures, lights = picture_box(box, config.views, config.view, config.seed)
    task = BoxTask(config, pictures, lights, possible_cells(box, config.occupancy))
    return task.loss(0, torch.Generator().manual_seed(0)).value.item()


@pytest.mark.parametrize("change", ["network=frequencies", "views=20", "view=12", "table=9", "seed=1"])
def test_every_setting_changes_the_first_step(box, change):
    settings = [resolve(PRESETS, overrides=s) for s in (SMALL, [*SMALL, change])]
    assert first_loss(box, settings[0]) != first_loss(box, settings[1])


def test_a_table_means_nothing_to_a_network_without_one(tmp_path):
    """Which is said before the texture is read."""
    with pytest.raises(ConfigError, match="table means nothing without a hash grid; leave it out"):
        fit(tmp_path / "none", set=["table=9", "network=frequencies"])


def test_patches_are_multiples_of_8():
    with pytest.raises(ConfigError, match="patch = 100 is no multiple of 8"):
        NerfTexConfig(patch=100)


@pytest.mark.parametrize(
    "setting", [{"patch": 0}, {"views": 8}, {"view": 4}, {"network": "grid"}, {"table": 3}]
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(ConfigError, match=next(iter(setting))):
        NerfTexConfig(**setting)
