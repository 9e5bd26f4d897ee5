"""Pictures by other formulas than those of the training, (64, 64, 3) sRGB."""

from collections.abc import Callable

import torch

COLOURS = {
    "red": (0.85, 0.1, 0.12),
    "green": (0.15, 0.6, 0.2),
    "blue": (0.15, 0.3, 0.85),
    "yellow": (0.95, 0.87, 0.15),
    "white": (1.0, 1.0, 1.0),
    "black": (0.0, 0.0, 0.0),
}
PERIOD = 14.0


def dots(x: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
    """Discs in rows."""
    return (x.remainder(PERIOD) - PERIOD / 2).square() + (y.remainder(PERIOD) - PERIOD / 2).square() < 18.0


def stripes(x: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
    return (x + 0.5 * y).remainder(PERIOD) < PERIOD / 2


def checks(x: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
    return ((x / PERIOD).floor() + (y / PERIOD).floor()) % 2 > 0


def grid(x: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
    return torch.minimum(x.remainder(PERIOD), y.remainder(PERIOD)) < 2


PATTERNS: dict[str, Callable[[torch.Tensor, torch.Tensor], torch.Tensor]] = {
    "dots": dots,
    "stripes": stripes,
    "checks": checks,
    "grid": grid,
}


def picture(pattern: str, figure: str, ground: str) -> torch.Tensor:
    y, x = torch.meshgrid(torch.arange(64.0), torch.arange(64.0), indexing="ij")
    inside = PATTERNS[pattern](x + 3, y + 5)[..., None]
    return torch.where(inside, torch.tensor(COLOURS[figure]), torch.tensor(COLOURS[ground]))
