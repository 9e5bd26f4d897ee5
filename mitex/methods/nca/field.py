"""A grown state as textures of Mitsuba scenes, decoded where rays meet the surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from mitex.mesh import Mesh
from mitex.methods.nca.decoder.decoder import OFFSET, Decoder
from mitex.methods.nca.decoder.surface import decoder_units
from mitex.methods.nca.look import Look
from mitex.plugins import init

if TYPE_CHECKING:
    from mitex.runtime.jit import mi
from mitex.runtime.upload import upload


def fields(look: Look, state: torch.Tensor, mesh: Mesh) -> dict[str, dict[str, Any]]:
    """Entries for Mitsuba dictionaries that show the maps of a look: map -> texture.

    They are `decoded_field`s; a look without a decoder has its values at the vertices, for `vertex_field`.
    Colours are sRGB, and none of the values are clipped to [0, 1].

    Args:
        look: what decodes the state.
        state: (V, C) on the mesh.
        mesh: that the automaton ran on; a shape with these textures has its vertices.
    """
    init()
    if isinstance(look.decoder, Decoder):
        texture = {"type": "decoded_field", "data": _tensor(state), **_mesh(mesh), **_decoder(look.decoder)}
    else:
        texture = {"type": "vertex_field", "data": _tensor(state[:, look.decoder.channels])}
    texture["offset"] = OFFSET
    return {name: texture | {"channel": columns[0]} for name, columns in look.layout.items()}


def _mesh(mesh: Mesh) -> dict[str, Any]:
    from mitex.runtime.jit import mi

    vertices = decoder_units(mesh).apply(mesh.vertices).astype(np.float32)
    return {"vertices": upload(mi.TensorXf, vertices), "faces": upload(mi.TensorXf, mesh.faces)}


def _decoder(decoder: Decoder) -> dict[str, Any]:
    """The decoder's properties of a `decoded_field`."""
    shape, waves = decoder.shape, decoder.waves
    properties: dict[str, Any] = {
        "interpolation": shape.interpolation,
        "coordinates": " ".join(shape.coordinates),
        "omega": shape.omega,
    }
    if "waves" in shape.coordinates:
        table = torch.cat([waves.vectors, waves.phases[:, None]], 1)
        properties |= {"waves": _tensor(table), "amplitude": waves.amplitude}
    for k, layer in enumerate(decoder.network.linear):
        properties |= {f"weight_{k}": _tensor(layer.weight), f"bias_{k}": _tensor(layer.bias)}
    return properties


def _tensor(values: torch.Tensor) -> mi.TensorXf:
    from mitex.runtime.jit import mi

    return upload(mi.TensorXf, values.detach().cpu().numpy())
