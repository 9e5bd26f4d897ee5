"""Errors of estimates of motion by octave of speed, on textures of kinds that no network was trained on."""

from __future__ import annotations

from collections.abc import Callable

import torch
from flow_pairs import PairMaker, Pairs
from flow_textures import HELD_OUT, textures

from mitex.evaluation.motion import MotionErrors, motion_errors
from mitex.features.flow import lucas_kanade

OCTAVES = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)  # limits of speed [px]
COUNT = 64  # pairs
SIDE = 128  # of the frames [px]

Estimate = Callable[[torch.Tensor], torch.Tensor]  # pairs (B, 2, H, W) -> motions (B, 2, H, W) [px]


def held_out(changes: bool) -> Pairs:
    """The pairs that estimates are judged by, with or without a changing look."""
    return PairMaker(textures(HELD_OUT), SIDE, changes).draw(COUNT, torch.Generator().manual_seed(1))


def by_octave(estimate: Estimate, pairs: Pairs) -> list[MotionErrors]:
    """Errors of an estimate where the true speed is in each octave, and below them."""
    with torch.no_grad():
        motion = torch.cat([estimate(frames) for frames in pairs.frames.split(8)])
    speed = pairs.motion.norm(dim=1)
    return [
        motion_errors(motion, pairs.motion, ((pairs.mask == 1) & (speed > low) & (speed <= high)).float())
        for low, high in zip(OCTAVES[:-1], OCTAVES[1:], strict=True)
    ]


def estimates(network: Estimate) -> dict[str, Estimate]:
    """A network, and what it is compared with."""
    return {
        "network": network,
        "Lucas-Kanade": lambda frames: lucas_kanade(frames[:, :1], frames[:, 1:]),
        "no motion": torch.zeros_like,
    }


def table(network: Estimate, pairs: Pairs) -> str:
    """End-point error [px], direction error and speed ratio of all estimates, in Markdown."""
    columns = {name: by_octave(estimate, pairs) for name, estimate in estimates(network).items()}
    lines = [" | ".join(["| speed [px]", *columns]) + " |", "| --- " * (1 + len(columns)) + "|"]
    for row, (low, high) in enumerate(zip(OCTAVES[:-1], OCTAVES[1:], strict=True)):
        cells = [_cell(errors[row]) for errors in columns.values()]
        lines.append(" | ".join([f"| {low:g} to {high:g}", *cells]) + " |")
    return "\n".join(lines)


def _cell(errors: MotionErrors) -> str:
    if errors.speed_ratio == 0:
        return f"{errors.end_point:.3f}"
    return f"{errors.end_point:.3f}, {errors.direction:.1f}°, {errors.speed_ratio:.2f}"
