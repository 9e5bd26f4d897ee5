"""The training of Text2Mesh from words, as a task (Michel et al. 2022)."""

from __future__ import annotations

import torch

from mitex.methods.baselines.text2mesh import METHOD
from mitex.methods.baselines.text2mesh.config import Text2MeshConfig, share_open
from mitex.methods.neural_style.field import colours, encoded, head, opened, random_waves, trunk
from mitex.methods.neural_style.task import StyleTask


class Text2MeshTextTask(StyleTask):
    """A network whose colours, and offsets along the normals, shall make views of a mesh be what words say.

    As published, but: waves are opened the slowest first, where the authors' code sorts their axes in place
    of them; outlines have no derivatives, shading alone; a lamp beside the camera stands for their light of
    spherical harmonics; the anchor view is the front, where theirs is the one that CLIP finds nearest to the
    text; elevations end at 80 degrees; meshes are split until they have 10,000 vertices; corners of all
    squares are moved outwards, where theirs go inwards, in four of five.
    """

    method = METHOD.name
    config: Text2MeshConfig

    def initial(self, generator: torch.Generator) -> dict[str, torch.Tensor]:
        config = self.config
        self.waves = random_waves(config.frequencies, config.sigma, generator)
        self.trunk = trunk(config.frequencies, config.width)
        self.heads = head("colours", config.width, 3), head("offsets", config.width, 1)
        return {k: v for part in (self.trunk, *self.heads) for k, v in part.weights(generator).items()}

    def style(self, step: int | None = None) -> tuple[torch.Tensor, torch.Tensor]:
        weights = opened(self.waves, share_open(self.config, step))
        features = self.trunk(self.named, encoded(self.points, self.waves, weights))
        colour, height = (part(self.named, features) for part in self.heads)
        return colours(colour), self.config.text_relief * height.tanh() * self.normals
