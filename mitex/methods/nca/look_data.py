"""A texture as the data of a page: what the page's scripts need to grow and to show it."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from mitex.cache import content_key
from mitex.methods.nca.decoder.decoder import Decoder, Readout
from mitex.methods.nca.decoder.surface import EDGE
from mitex.methods.nca.displacement import known_relief
from mitex.methods.nca.look import MARGIN, traits
from mitex.methods.nca.motion.cell_motion import fastest, is_advected, period
from mitex.methods.nca.palette import NEARLY, TOLERANCE, Palette
from mitex.methods.nca.texture import NcaTexture
from mitex.page import packed


def look_data(texture: NcaTexture) -> dict[str, Any]:
    """A texture as JSON values: its rule, the bounds of its states, its decoder and its palette."""
    look = texture.look
    rule, margin = look.rule, MARGIN * (look.high - look.low)
    record, longest = texture.about.get("palette"), fastest(texture.about)
    return {
        "name": str(texture.about.get("name", "texture")),
        "steps": texture.steps,
        "family": content_key(texture.family, repr(sorted(traits(look).items()))),
        "relief": 0.0 if "normal" in look.maps else 2 * EDGE * known_relief(texture.about, look.maps),
        "fastest": longest if np.isfinite(longest) else None,
        "carried": is_advected(look, texture.about),
        "period": period(texture.about),
        "channels": rule.channels,
        "hidden": rule.hidden,
        "condition": rule.condition,
        "degree": rule.degree,
        "mean": look.mean,
        "weight1": _numbers(rule.fc1.weight),
        "bias1": _numbers(rule.fc1.bias),
        "weight2": _numbers(rule.fc2.weight),
        "bias2": _numbers(rule.fc2.bias),
        "low": _numbers(look.low - margin),
        "high": _numbers(look.high + margin),
        "maps": {key: list(columns) for key, columns in look.layout.items()},
        "decoder": _decoder_data(look.decoder),
        "palette": None if record is None else _palette_data(Palette.from_record(record)),
    }


def _decoder_data(decoder: Decoder | Readout) -> dict[str, Any]:
    if isinstance(decoder, Readout):
        return {"channels": decoder.channels}
    shape, waves = decoder.shape, decoder.waves
    return {
        "interpolation": shape.interpolation,
        "coordinates": list(shape.coordinates),
        "omega": shape.omega,
        "waves": _numbers(torch.cat([waves.vectors, waves.phases[:, None]], 1)),
        "amplitude": waves.amplitude,
        "layers": [
            {
                "outputs": layer.out_features,
                "inputs": layer.in_features,
                "weight": _numbers(layer.weight),
                "bias": _numbers(layer.bias),
            }
            for layer in decoder.network.linear
        ],
    }


def _palette_data(palette: Palette) -> dict[str, Any]:
    limit = np.float32(palette.radius + TOLERANCE) * NEARLY
    return {"colours": palette.colours.tolist(), "limit": float(limit)}


def _numbers(values: torch.Tensor) -> dict[str, str]:
    return packed(values.detach().float().cpu().numpy())
