"""Patterns of separate shapes."""

from __future__ import annotations

import math

import torch
from word_places import Cell, Drawn, Place, lattice, turned, wave


def shapes(p: Place, cell: Cell, inside: torch.Tensor) -> Drawn:
    """Separate shapes from the distance to their borders, slightly raised."""
    return Drawn(p.edge(inside), cell.element, (inside / 0.15).clamp(0, 1) ** 0.5)


def scattered(p: Place) -> Cell:
    """Cells for separate shapes: in straight or shifted rows, somewhat out of place in some pictures."""
    rows = (p.random(1) < 0.5) * 0.5
    return lattice(p, rows, 0.15)


def dots(p: Place) -> Drawn:
    cell = scattered(p)
    return shapes(p, cell, p.random(2, 0.24, 0.38) - torch.hypot(cell.x, cell.y))


def rings(p: Place) -> Drawn:
    cell = scattered(p)
    return shapes(p, cell, p.random(2, 0.07, 0.1) - (torch.hypot(cell.x, cell.y) - 0.3).abs())


def stars(p: Place) -> Drawn:
    cell = turned(scattered(p), p.random(3))
    angle = torch.atan2(cell.y, cell.x) / (2 * math.pi) * 5
    return shapes(p, cell, 0.17 + 0.25 * (1 - wave(angle)) ** 1.3 - torch.hypot(cell.x, cell.y))


def flowers(p: Place) -> Drawn:
    cell = turned(scattered(p), p.random(3))
    radius = torch.hypot(cell.x, cell.y)
    petals = 0.31 + 0.12 * torch.cos(5 * torch.atan2(cell.y, cell.x)) - radius
    return shapes(p, cell, torch.minimum(petals, radius - 0.09))


def hearts(p: Place) -> Drawn:
    cell = scattered(p)
    x, y = cell.x.abs(), 0.05 - cell.y
    lobes = 0.2 - torch.hypot(x - 0.15, y - 0.12)
    tip = torch.minimum((0.36 - x + y * 0.9) * 0.7, 0.14 - y)
    return shapes(p, cell, torch.maximum(lobes, torch.minimum(tip, 0.34 - x)))


def triangles(p: Place) -> Drawn:
    cell = turned(scattered(p), p.random(3))
    sides = torch.maximum(cell.y, 0.866 * cell.x.abs() - 0.5 * cell.y)
    return shapes(p, cell, 0.21 - sides)


def crosses(p: Place) -> Drawn:
    cell = turned(scattered(p), (p.random(3) < 0.4) * 0.125)
    x, y = cell.x.abs(), cell.y.abs()
    return shapes(p, cell, torch.minimum(0.1 - torch.minimum(x, y), 0.38 - torch.maximum(x, y)))


def leaves(p: Place) -> Drawn:
    cell = lattice(p, 0.5, 0.25)
    cell = turned(cell, p.random(3) + 0.15 * (cell.element - 0.5))
    lens = 0.68 - torch.hypot(cell.x.abs() + 0.48, cell.y)
    rib = 0.025 - cell.x.abs()
    return shapes(p, cell, torch.minimum(lens, -rib))
