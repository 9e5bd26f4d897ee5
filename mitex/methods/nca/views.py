"""Pictures of what a state shows, as cameras see it."""

from __future__ import annotations

import torch

from mitex.methods.nca.decoder.decoder import Decoder, Readout
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.scenes.cameras import Cameras
from mitex.scenes.stage import Stage


def render_views(
    decoder: Decoder | Readout,
    state: torch.Tensor,
    surface: Surface,
    stage: Stage,
    cameras: Cameras,
    antialias: int = 1,
) -> torch.Tensor:
    """Images (K, H, W, C) of the values, 0 where a camera sees nothing; differentiable in the state.

    Args:
        decoder: what reads the values.
        state: (V, C).
        surface, stage: of the mesh.
        cameras: K views.
        antialias: n for n x n samples in each pixel.
    """
    hits = stage.hits(cameras, antialias)
    points = Points(hits.face, hits.barycentric)
    values = decoder(surface, surface.table(state), points)
    if len(values) < len(hits.hit):
        values = values.new_zeros(len(hits.hit), values.shape[1]).index_put(
            (hits.hit.to(values.device),), values
        )
    return values.view(-1, antialias * antialias, values.shape[1]).mean(1).view(*cameras.shape, -1)
