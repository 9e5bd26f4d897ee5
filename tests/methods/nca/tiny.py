"""The smallest training that is one, and a model without any training."""

import torch

from mitex.methods.nca import PRESETS, MeshNCA, NcaConfig, NcaTexture
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.look import Look
from mitex.training import resolve

SETTINGS = (
    *("frequency=8", "resolution=32", "exemplar_size=32", "target_size=32", "density=8", "view_count=4"),
    *("layers=relu1_1,relu2_1", "pool=4", "inject_every=3", "min_steps=2", "max_steps=4", "hidden=16"),
    *("samples=256", "checkpoint_every=100", "preview_every=0", "zooms=1", "surfaces=even", "order_weight=0"),
    *("decoder_width=12", "waves=8"),
)


def config(*settings: str, preset: str = "patch") -> NcaConfig:
    return resolve(PRESETS, preset, None, [*SETTINGS, "steps=6", *settings])


SHAPE = DecoderShape(waves=8, width=12, depth=2)


def texture(
    maps: tuple[str, ...] = ("albedo",), seed: int = 0, shape: DecoderShape | None = SHAPE, **options
) -> NcaTexture:
    """Random weights that grow something; `shape` of the decoder, None for the state's own channels."""
    look = Look(MeshNCA(**options), maps, shape)
    look.initialise(torch.Generator().manual_seed(seed), gain=0.5)
    return NcaTexture(look, {"name": "tiny"})


def same_weights(one: torch.nn.Module, other: torch.nn.Module) -> bool:
    a, b = one.state_dict(), other.state_dict()
    return a.keys() == b.keys() and all(torch.equal(a[k], b[k]) for k in a)
