"""The field in plain torch: what `mitex.methods.nerf.field.decoder` is measured and tested against."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import torch
from torch.nn import functional as F

from mitex.methods.nerf.field.decoder import DULL, Reflection
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.networks import COARSE

PRIMES = (1, 2654435761, 805459861)


def decoded(
    f: torch.Tensor, phase: torch.Tensor, distance: torch.Tensor, weights: Sequence[torch.Tensor]
) -> torch.Tensor:
    """Density, k_d (3), k_s facing and grazing, g, theta and phi, (N, 9).

    Of f (N, 16), f-hat (N, 8) and distances (N,).
    """
    waves = [distance[:, None]]
    for octave in range(12):
        angle = distance[:, None] * 2**octave
        waves += [torch.sin(angle), torch.cos(angle)]
    fine, matrices = torch.cat(waves, 1), iter(weights)
    density = _network(2, torch.cat([f, fine], 1), matrices)
    reflection = _network(3, density[:, 1:], matrices)
    theta = _network(3, torch.cat([f, fine[:, :COARSE]], 1), matrices)
    phi = _network(3, torch.cat([phase, fine[:, :COARSE]], 1), matrices)
    gloss = F.softplus(reflection[:, 4:5]) + 1
    facing = reflection[:, :4].sigmoid()
    grazing = (reflection[:, 5:] - DULL).sigmoid() if reflection.shape[1] > 5 else facing[:, 3:]
    return torch.cat([density[:, :1].exp(), facing, grazing, gloss, theta, phi], 1)


def outputs(reflection: Reflection) -> list[Any]:
    """The same nine of the field's own networks."""
    ends = reflection.specular, reflection.grazing
    return [
        reflection.density,
        *reflection.diffuse,
        *ends,
        reflection.glossiness,
        reflection.theta,
        reflection.phi,
    ]


def encoded(encoding: Encoding, which: int, points: torch.Tensor, table: torch.Tensor) -> torch.Tensor:
    """Features (N, 2 L) of points (N, 3) in the cube, level by level and corner by corner."""
    grid = encoding.grids[which]
    columns = []
    for part, cells in zip(grid.levels, grid.cells, strict=True):
        entries = table[part].view(-1, 2)
        scale = cells - 1
        side = int(-(-scale // 1)) + 1
        place = (points * 0.5 + 0.5) * scale
        low = place.floor().long()
        share = place - low
        total = 0
        for corner in itertools.product((0, 1), repeat=3):
            near = torch.tensor(corner)
            weight = torch.where(near.bool(), share, 1 - share).prod(1, keepdim=True)
            total = total + weight * entries.index_select(0, _index(low + near, side, len(entries)))
        columns.append(total)
    return torch.cat(columns, 1)


def _index(cell: torch.Tensor, side: int, entries: int) -> torch.Tensor:
    if side**3 <= entries:
        return cell @ torch.tensor([1, side, side * side])
    x, y, z = ((cell[:, k] * PRIMES[k]) & 0xFFFFFFFF for k in range(3))
    return (x ^ y ^ z) % entries


def _network(layers: int, x: torch.Tensor, weights: Iterator[torch.Tensor]) -> torch.Tensor:
    for k in range(layers):
        x = x @ next(weights).T
        x = torch.relu(x) if k < layers - 1 else x
    return x
