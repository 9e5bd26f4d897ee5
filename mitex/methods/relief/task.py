"""The optimization of a relief, as a task."""

from __future__ import annotations

import numpy as np
import torch

from mitex.cache import content_key
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.features.coverage import fully_covered
from mitex.losses import gram_matrix, moment_distance, relaxed_transport
from mitex.mesh import Mesh
from mitex.methods.relief.config import ReliefConfig
from mitex.methods.relief.pictures import CloseUps, Pictures
from mitex.methods.relief.shape import Shape
from mitex.methods.relief.start import Start
from mitex.runtime import keep_freed_memory
from mitex.training import ParameterTask, Step

LEAST = 32  # side of the exemplar beside a close-up [px], which four layers need
LARGEST = 8  # side of the exemplar [close-ups]


class ReliefTask(ParameterTask):
    """A mesh that is moved until close-ups of it have the features of an exemplar's relief.

    Args:
        config: settings.
        exemplar: with height and normal maps.
        depth: of its relief [its widths].
        start: what is moved.

    Attributes:
        unit: width of the exemplar on the mesh [mesh units].
        width: of what a close-up shows [widths of the exemplar].
    """

    def __init__(self, config: ReliefConfig, exemplar: Exemplar, depth: float, start: Start) -> None:
        keep_freed_memory()
        self.config, self._exemplar, self._start = config, exemplar, start
        self.unit = start.exemplar_width(config)
        coarse, fine = (
            mesh.with_vertices(mesh.vertices / np.float32(self.unit)) for mesh in (start.mesh, start.fine)
        )
        self.shape = Shape(fine, config.smoothing, config.sideways)
        super().__init__({"relief": self.shape.coordinates(depth * start.heights)})
        side = round(config.view / config.width if config.width else 1 / fine.edge_lengths.mean())
        side = min(max(side, LEAST), LARGEST * config.view)
        self.width = config.view / side
        self.pictures = Pictures(exemplar.resized(side), config.joint and start.colours is not None)
        self.views = CloseUps(coarse, start.directions, self.shape, start.colours, self.pictures, depth)
        self.network = Vgg16()
        self._targets = {
            layer: values.flatten(1, 2)
            for layer, values in self.network.features(self.pictures.exemplar, config.layers).items()
        }
        self._grams = {layer: gram_matrix(values) for layer, values in self._targets.items()}

    @property
    def offsets(self) -> torch.Tensor:
        """(V, 3) of the vertices [widths of the exemplar]."""
        return self.shape.offsets(self.named["relief"])

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """The distance of all kinds of pictures and layers, summed."""
        config = self.config
        cameras = self.views.cameras(generator, config.views, self.width, config.view)
        offsets = self.offsets
        pictures, counts = self.views(offsets, cameras)
        total = 0 * offsets.sum()  # close-ups may see nothing that counts
        for layer, values in self.network.features(pictures.flatten(0, 1), config.layers).items():
            inside = fully_covered(counts, (values.shape[1], values.shape[2]))
            by_kind = values.unflatten(0, pictures.shape[:2]).transpose(0, 1)
            for kind in range(self.pictures.kinds):
                total = total + self._distance(by_kind[kind][inside], layer, kind, generator)
        return Step(total, {"seen": float(counts.float().mean())})

    def _distance(
        self, rows: torch.Tensor, layer: str, kind: int, generator: torch.Generator
    ) -> torch.Tensor:
        """Of features (n, C) of close-ups from the exemplar's."""
        if len(rows) < 2:
            return torch.zeros(())
        if self.config.loss == "gram":
            target = self._grams[layer][kind]
            return ((gram_matrix(rows) - target) / target.abs().mean()).square().mean()
        theirs = self._targets[layer][kind]
        count = min(len(rows), len(theirs), self.config.samples)
        ours, theirs = (
            part[torch.randperm(len(part), generator=generator)[:count]][None] for part in (rows, theirs)
        )
        moments = self.config.moment_weight * moment_distance(ours, theirs)
        return (relaxed_transport(ours, theirs) + moments).sum()

    @torch.no_grad()
    def moved(self) -> Mesh:
        """The mesh in its own units, moved."""
        return self._start.fine.with_vertices(self.unit * self.shape.moved(self.offsets).numpy())

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The exemplar's normals and heights, and those of three close-ups."""
        config = self.config
        cameras = self.views.cameras(torch.Generator().manual_seed(0), 3, self.width, config.view)
        pictures, _ = self.views(self.offsets, cameras)
        beside = torch.full_like(pictures[0], 0.5)
        part = self.pictures.exemplar[:, : config.view, : config.view]
        beside[:, : part.shape[1], : part.shape[2]] = part
        rows = [torch.cat([beside[kind], *pictures[:, kind]], 1) for kind in range(2)]
        return torch.cat(rows).clamp(0, 1).numpy()

    def metadata(self) -> dict[str, str]:
        mesh = self._start.mesh
        return {"method": "relief", "layout_key": content_key(mesh.uv), **inputs(self._exemplar, mesh)}


def inputs(exemplar: Exemplar, mesh: Mesh) -> dict[str, str]:
    """What a run that goes on must have been made with."""
    return {
        "exemplar": exemplar.name,
        "exemplar_key": exemplar.key,
        "mesh": mesh.name,
        "mesh_key": content_key(mesh.vertices, mesh.faces),
    }
