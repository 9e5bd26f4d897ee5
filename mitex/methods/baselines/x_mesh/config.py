"""Settings of X-Mesh, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.methods.neural_style.config import EMBEDDED, PUBLISHED_WEIGHTS, StyleConfig
from mitex.training.settings import key


@dataclass(frozen=True)
class XMeshConfig(StyleConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    preset: str = "text"
    steps: int = 600
    sigma: float = key(12.0, "spread of their frequencies [cycles a deviation of the places]", 0.01, 1000)
    views: int = 4
    cameras: Literal["around", "anchored"] = "anchored"
    milestones: tuple[int, ...] = tuple(range(100, 600, 100))
    text: str | None = "red dots on white"
    text_crops: int = 2
    text_crop_area: float = 0.4
    text_relief_crop_area: float = 0.4
    text_close_weight: float = PUBLISHED_WEIGHTS["text_close_weight"]
    text_relief_weight: float = PUBLISHED_WEIGHTS["text_relief_weight"]
    mirror: bool = key(False, "the same on both sides of the plane z = 0 (the paper)")
    gate_width: int = key(32, "width of the hidden layers of the gates", 1, 4096)
    rank: int = key(30, "rank of the gates' weights", 1, 4096)
    gate_start: float = key(
        0.1, "spread of their hidden layers' factor at first; 0 (the paper): they never learn", 0
    )
    preview_every: int = 50


DEFAULT = XMeshConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "text-words": replace(
        DEFAULT,
        preset="text-words",
        sigma=0.8,
        gate_width=16,
        **EMBEDDED | {"lr": 3e-4, "text_close_weight": 1.0},
    ),
    "text-paper": replace(
        DEFAULT,
        preset="text-paper",
        steps=1200,
        views=5,
        milestones=tuple(range(100, 1200, 100)),
        text_crops=4,
        text_relief_crop_area=0.1,
        mirror=True,
        gate_start=0.0,
    ),
}
