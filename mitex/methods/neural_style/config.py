"""Settings that neural style fields share: of the network, the views, and the words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from mitex.methods.words.config import WordsConfig, check_words
from mitex.training.settings import ScheduledConfig, key


@dataclass(frozen=True)
class StyleConfig(WordsConfig, ScheduledConfig):
    """What shapes the training of a network of colours, and from words of offsets too."""

    resolution: int = key(512, "side of the texture that the colours are baked into [texels]", 16, 4096)
    frequencies: int = key(256, "random waves of the place that the network reads", 1, 4096)
    sigma: float = key(12.0, "spread of their frequencies [cycles a radius]", 0.01, 1000)
    width: int = key(256, "width of the network's layers", 1, 4096)
    views: int = key(2, "pictures in a step", 1, 64)
    cameras: Literal["around", "anchored"] = key(
        "around", "uniformly in all directions, or around the front (the paper)"
    )
    view: int = key(224, "side of a picture [px]", 32, 2048)
    fov: float = key(60.0, "field of view [degrees]", 1, 120)
    distance: float = key(2.0, "distance of the cameras [radii]", 1.01, 1000)
    lr: float = 5e-4
    milestones: tuple[int, ...] = (100, 200, 300)
    decay: float = 0.9
    text_vertices: int = key(
        10_000, "least number of vertices; faces of meshes with fewer are split", 1, 1_000_000
    )
    text_relief: float = key(0.1, "largest displacement of a vertex [radii]", 0, 1)
    text_each: bool = key(
        False, "compare the text with each picture; false: with the views' mean embedding (the paper)"
    )
    text_relief_weight: float = key(
        1.0, "weight of the distance of close-ups without colours from the text", 0
    )
    text_relief_crop_area: float = key(
        0.1, "area of a close-up without colours, as a share of the view", 1e-3, 1
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_words(self, "text_whole_weight", "text_close_weight", "text_relief_weight")


# Each of the four close-ups weighs as much as a whole view (Text2Mesh's and X-Mesh's code).
PUBLISHED_WEIGHTS: dict[str, Any] = {"text_close_weight": 4.0, "text_relief_weight": 4.0}

# For the model that ships with the package: it knows patterns that fill small pictures, but no reliefs.
# White around the mesh would count as a colour of the text.
EMBEDDED: dict[str, Any] = {
    "steps": 200,
    "frequencies": 64,
    "width": 128,
    "views": 4,
    "cameras": "around",
    "lr": 1e-3,
    "milestones": (100,),
    "text_prompt": "{text}",
    "text_background": 0.5,
    "text_each": True,
    "text_crops": 4,
    "text_crop_area": 0.3,
    "text_relief_crop_area": 0.3,
    "text_tilt": 0.0,
    "text_whole_weight": 0.0,
    "text_relief_weight": 0.0,
}
