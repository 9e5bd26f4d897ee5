"""The smallest training from words, and a vision-language model whose meaning is plain."""

from collections.abc import Sequence

import torch

from mitex.methods.nca import PRESETS, NcaConfig
from mitex.methods.nca.text.task import TextTask
from mitex.training import resolve

SETTINGS = (
    *("frequency=4", "surfaces=even", "pool=2", "inject_every=3", "min_steps=2", "max_steps=3", "hidden=16"),
    *("resolution=24", "view_count=2", "text_bank=3", "text_crops=2", "decoder_width=12", "waves=8"),
    *("text_parent=none", "checkpoint_every=100", "preview_every=0"),
)
COLOURS = {
    "red": (1.0, 0.1, 0.1),
    "green": (0.1, 1.0, 0.1),
    "sphere": (0.7, 0.7, 0.7),
    "torus": (0.7, 0.7, 0.6),
}


class MeanColour:
    """Embeds a picture as its mean colour and its contrast, a text as the colour that it names."""

    name = "mean colour"
    resolution = 16

    def encode_images(self, images: torch.Tensor) -> torch.Tensor:
        contrast = images.var((1, 2)).sum(1, keepdim=True)
        return torch.cat([images.mean((1, 2)), contrast, torch.ones_like(contrast)], 1)

    def encode_texts(self, texts: Sequence[str]) -> torch.Tensor:
        named = [next(rgb for word, rgb in COLOURS.items() if word in text) for text in texts]
        return torch.tensor([[*rgb, 0.1, 1.0] for rgb in named])


def config(*settings: str, text: str = "red", preset: str = "text") -> NcaConfig:
    return resolve(PRESETS, preset, None, [*SETTINGS, f"text={text}", "steps=6", *settings])


def task(*settings: str, text: str = "red", **options) -> TextTask:
    return TextTask(config(*settings, text=text), MeanColour(), **options)


def grown(one: TextTask) -> TextTask:
    """The task with states in its pool that show something."""
    one.pool.copy_(0.3 * torch.randn(one.pool.shape, generator=torch.Generator().manual_seed(3)))
    one._touched[:] = True
    return one


def loss(one: TextTask, step: int = 1, seed: int = 0):
    """A step; step 1 does not inject the seed."""
    return one.loss(step, torch.Generator().manual_seed(seed))
