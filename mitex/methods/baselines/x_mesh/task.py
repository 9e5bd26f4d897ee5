"""The training of X-Mesh, as a task (Ma et al. 2023)."""

from __future__ import annotations

import math

import torch

from mitex.methods.baselines.x_mesh import METHOD
from mitex.methods.baselines.x_mesh.config import XMeshConfig
from mitex.methods.baselines.x_mesh.gates import Gate
from mitex.methods.neural_style.field import colours, encoded, head, random_waves, trunk
from mitex.methods.neural_style.task import StyleTask


class XMeshTask(StyleTask):
    """A network whose colours and free offsets shall make views of a mesh be what words say.

    Between the trunk and the heads, words open gates: first of the channels, then of the vertices.

    As published, but, like Text2Mesh here: outlines have no derivatives, shading alone; a lamp beside the
    camera stands for their light of spherical harmonics; the anchor view is the front; elevations end at 80
    degrees; meshes are split until they have 10,000 vertices; corners of all squares are moved outwards,
    where theirs go inwards, in four of five; the moved mesh is not fitted into the unit ball
    again, as theirs is in each step.
    """

    method = METHOD.name
    config: XMeshConfig

    def initial(self, generator: torch.Generator) -> dict[str, torch.Tensor]:
        config = self.config
        size, shape = self.text.shape[1], (config.width, config.gate_width, config.rank)
        self.waves = random_waves(config.frequencies, config.sigma, generator)
        self.trunk = trunk(config.frequencies, config.width, normalised=True)
        self.gates = Gate.of("channels", size, *shape, axis=0), Gate.of("vertices", size, *shape, axis=1)
        self.heads = (
            head("colours", config.width, 3, normalised=True),
            head("offsets", config.width, 3, normalised=True),
        )
        self.places = places(self.points, config.mirror)
        layers = [part.weights(generator) for part in (self.trunk, *self.heads)]
        gates = [gate.weights(generator, config.gate_start) for gate in self.gates]
        return {name: value for part in (*layers, *gates) for name, value in part.items()}

    def style(self, step: int | None = None) -> tuple[torch.Tensor, torch.Tensor]:
        features = self.trunk(self.named, encoded(self.places, self.waves))
        for gate in self.gates:
            features = gate(self.named, features, self.text[0])
        colour, offset = (part(self.named, features) for part in self.heads)
        return colours(colour), self.config.text_relief / math.sqrt(3) * offset.tanh()


def places(points: torch.Tensor, mirror: bool) -> torch.Tensor:
    """(V, 3) points, z without its sign if mirrored, less their mean, in their standard deviations."""
    sides = torch.cat([points[:, :2], points[:, 2:].abs()], 1) if mirror else points
    return (sides - sides.mean(0)) / sides.std(0).clamp_min(1e-6)
