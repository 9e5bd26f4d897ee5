"""One seed for every generator of random numbers."""

from __future__ import annotations

import random
from importlib import import_module
from typing import TYPE_CHECKING

from mitex.errors import ConfigError
from mitex.ranges import SEEDS

if TYPE_CHECKING:
    import torch


def seed_everything(seed: int) -> torch.Generator:
    """Seeds Python's, NumPy's and torch's global generators and returns an own CPU generator with that seed.

    Raises:
        ConfigError: `seed` is not in [0, 2**32).
    """
    least, most = SEEDS
    if not least <= seed <= most:
        raise ConfigError(f"seed {seed} is out of range", f"use a whole number from {least} to {most}")
    torch = import_module("torch")
    random.seed(seed)
    import_module("numpy").random.seed(seed)
    torch.manual_seed(seed)
    return torch.Generator().manual_seed(seed)
