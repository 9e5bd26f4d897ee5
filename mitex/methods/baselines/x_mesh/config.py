"""Settings of X-Mesh, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mitex.methods.style_config import StyleConfig
from mitex.training.settings import key


@dataclass(frozen=True)
class XMeshConfig(StyleConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    preset: str = "text-words"
    steps: int = 300
    frequencies: int = 64
    sigma: float = key(1.5, "spread of their frequencies [cycles a deviation of the places]", 0.01, 1000)
    width: int = 128
    views: int = 4
    text: str | None = "red dots on white"
    text_prompt: str = "{text}"
    text_tilt: float = 0.0
    text_crop_area: float = 0.15
    text_whole_weight: float = 0.0
    text_relief_weight: float = 0.0
    mirror: bool = key(False, "the same on both sides of the plane z = 0 (the paper)")
    gate_width: int = key(16, "of the hidden layers of the gates", 1, 4096)
    rank: int = key(30, "of the gates' weights", 1, 4096)
    gate_start: float = key(
        0.1, "spread of their hidden layers' factor at first; 0 (the paper): they never learn", 0
    )
    preview_every: int = 50


DEFAULT = XMeshConfig()
CLIP = replace(
    DEFAULT,
    preset="text",
    steps=600,
    frequencies=256,
    width=256,
    sigma=12.0,
    gate_width=32,
    cameras="anchored",
    milestones=tuple(range(100, 600, 100)),
    text_prompt=StyleConfig.text_prompt,
    text_tilt=StyleConfig.text_tilt,
    text_crops=2,
    text_whole_weight=1.0,
    text_relief_weight=1.0,
)
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "text": CLIP,
    "text-paper": replace(
        CLIP,
        preset="text-paper",
        steps=1200,
        views=5,
        milestones=tuple(range(100, 1200, 100)),
        text_crops=4,
        text_crop_area=0.4,
        mirror=True,
        gate_start=0.0,
    ),
}
