"""The smallest trainings of neural style fields from words."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import torch

from mitex.mesh import Mesh, icosphere
from mitex.methods.baselines.text2mesh.config import PRESETS as TEXT2MESH
from mitex.methods.baselines.text2mesh.text_task import Text2MeshTextTask
from mitex.methods.baselines.x_mesh.config import PRESETS as X_MESH
from mitex.methods.baselines.x_mesh.task import XMeshTask
from mitex.methods.layout import with_layout
from mitex.methods.neural_style.config import StyleConfig
from mitex.methods.neural_style.task import StyleTask
from tests.methods.nca.text.tiny_text import MeanColour

SMALL: dict[str, Any] = {
    "resolution": 32,
    "frequencies": 4,
    "width": 8,
    "view": 32,
    "views": 2,
    "text": "red",
    "text_vertices": 100,
    "text_crops": 2,
    "text_whole_weight": 1.0,
    "text_relief_weight": 0.5,
    "text_crop_area": 0.15,
    "text_background": 1.0,
    "text_each": False,
    "lr": 0.01,
    "checkpoint_every": 2,
    "preview_every": 0,
    "milestones": (),
}
BALL: Mesh = with_layout(icosphere(2), 32)
KINDS: dict[str, tuple[StyleConfig, type[StyleTask]]] = {
    "text2mesh": (replace(TEXT2MESH["text-words"], **SMALL), Text2MeshTextTask),
    "x_mesh": (replace(X_MESH["text-words"], **SMALL), XMeshTask),
}


def tiny(name: str, **options: Any) -> StyleTask:
    config, task = KINDS[name]
    return task(replace(config, **options), MeanColour(), BALL)


def maker(name: str) -> Callable[[], StyleTask]:
    return lambda: tiny(name)


def shaken(task: StyleTask, spread: float = 1.0) -> StyleTask:
    """The task with last layers that are not zero, those of its gates neither."""
    generator = torch.Generator().manual_seed(0)
    for name, value in task.named.items():
        if name in ("colours.2.weight", "offsets.2.weight") or name.endswith(".1.factor"):
            value.data.normal_(0, spread, generator=generator)
    return task
