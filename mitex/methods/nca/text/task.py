"""The training of a look from words as a task for the loop (MeshNCA, section 4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

from mitex.cache import content_key
from mitex.errors import ConfigError
from mitex.features.text_image import TextImageModel
from mitex.losses import (
    directional_distance,
    laplacian_excess,
    mean_direction,
    overflow_loss,
    text_distance,
)
from mitex.mesh import Mesh
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.pool import PoolTask, initial_look
from mitex.methods.nca.surfaces import TrainingSphere, TrainingSurface, training_surfaces
from mitex.methods.nca.text.views import Figure, Sight, Views
from mitex.methods.nca.text.wording import MAPS, prompts
from mitex.progress import announce
from mitex.runtime import available_device, keep_freed_memory
from mitex.scenes.cameras import orbit

SAME = 1e-4  # squared distance of the unit embeddings of texts that mean the same
PREVIEW = 256  # side of a preview's pictures [px]


@dataclass(frozen=True, eq=False)
class Negative:
    """What a sight of the surface without its texture is to the model: mean directions (D,) of the whole
    views and of the close-ups.
    """

    whole: torch.Tensor
    close: torch.Tensor


class TextTask(PoolTask):
    """Trains a look to be what words say, in the eyes of a model of texts and images.

    Args:
        config: settings, `text` among them.
        model: the frozen model.
        init: what to start from; None draws new weights from the seed.
        lineage: name of the model to start from, and its family, for the checkpoint.
        mesh: to train on; None for the spheres of the config.

    Raises:
        ConfigError: the text says no more than the name of the object, or what the model does not know.
    """

    def __init__(
        self,
        config: NcaConfig,
        model: TextImageModel,
        init: Look | None = None,
        lineage: Mapping[str, str] | None = None,
        mesh: Mesh | None = None,
    ) -> None:
        device = available_device(config.device)
        keep_freed_memory()
        self.model, self.mesh = model, mesh
        self.thing = config.text_object or ("sphere" if mesh is None else mesh.name)
        self.text, self.negative_text = self._texts(config)
        announce("preparing what is trained on")
        look = initial_look(config, MAPS, init, device)
        surfaces = training_surfaces(config, look) if mesh is None else [training_mesh(mesh, look)]
        super().__init__(config, look, surfaces, lineage)
        self.spheres = [surface for surface in surfaces if isinstance(surface, TrainingSphere)]
        self.figures = {sphere: Figure(sphere, config.text_relief, device) for sphere in self.spheres}
        self._edges = {sphere: _edges(sphere.mesh, device) for sphere in self.spheres}
        self._negatives: dict[tuple[TrainingSphere, int], Negative] = {}

    def _texts(self, config: NcaConfig) -> tuple[torch.Tensor, torch.Tensor]:
        """Directions of what is wanted and of the bare object, whose name counts in steps from it alone."""
        text, negative = prompts(config, self.thing)
        if not config.text_directional:
            negative = text
        both = torch.nn.functional.normalize(self.model.encode_texts([text, negative]), dim=1)
        if config.text_directional and (both[0] - both[1]).square().sum() < SAME:
            raise ConfigError(f"'{text}' means no more than '{negative}'", "say more about the texture")
        return both[0], both[1]

    def terms(
        self, surface: TrainingSurface, state: torch.Tensor, generator: torch.Generator
    ) -> dict[str, torch.Tensor]:
        assert isinstance(surface, TrainingSphere)
        config = self.config
        index = int(torch.randint(config.text_bank, (), generator=generator))
        sight = self.sight(surface, index)
        views = self.figures[surface].textured(self.look, state, sight.cameras)
        excess = laplacian_excess(2 * views.height - 1, *self._edges[surface], config.text_roughness)
        return self._distances(views, sight, self.negative(surface, index)) | {
            "rough": config.text_smooth_weight * excess,
            "range": config.text_range_weight * overflow_loss(2 * views.values - 1),
        }

    def sight(self, surface: TrainingSphere, index: int) -> Sight:
        """One of the bank's."""
        seed = self.config.seed * self.config.text_bank + index
        return Sight.draw(self.config, surface, torch.Generator().manual_seed(seed))

    @torch.no_grad()
    def negative(self, surface: TrainingSphere, index: int) -> Negative:
        """Of a sight of the bank, computed when it is wanted first."""
        if (surface, index) not in self._negatives:
            sight = self.sight(surface, index)
            pictures, size = self.figures[surface].bare(sight.cameras), self.model.resolution
            squares = [sight.whole(pictures, size), sight.close(pictures, size)]
            self._negatives[surface, index] = Negative(*self._directions(squares))
        return self._negatives[surface, index]

    def _distances(self, views: Views, sight: Sight, negative: Negative) -> dict[str, torch.Tensor]:
        """The three terms of equation 9, weighted."""
        config, size = self.config, self.model.resolution
        parts = {
            "whole": (config.text_whole_weight, sight.whole, views.coloured, negative.whole),
            "close": (config.text_close_weight, sight.close, views.coloured, negative.close),
            "relief": (config.text_relief_weight, sight.close, views.plain, negative.close),
        }
        parts = {name: part for name, part in parts.items() if part[0]}
        squares = [augmentation(pictures, size) for _, augmentation, pictures, _ in parts.values()]
        return {
            name: weight * self._distance(direction, bare)
            for (name, (weight, _, _, bare)), direction in zip(
                parts.items(), self._directions(squares), strict=True
            )
        }

    def _distance(self, pictures: torch.Tensor, bare: torch.Tensor) -> torch.Tensor:
        if self.config.text_directional:
            return directional_distance(pictures, bare, self.text, self.negative_text)
        return text_distance(pictures, self.text)

    def _directions(self, groups: list[torch.Tensor]) -> list[torch.Tensor]:
        """The mean direction (D,) of each group of pictures (N, R, R, 3), all encoded at once."""
        embeddings = self.model.encode_images(torch.cat(groups))
        return [mean_direction(part) for part in embeddings.split([len(group) for group in groups])]

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """Two views of an evolved state, coloured, and grey below."""
        surface, state, _ = self.example(step)
        assert isinstance(surface, TrainingSphere)
        cameras = orbit(2, distance=2.05, resolution=PREVIEW, start=90)
        views = self.figures[surface].textured(self.look, state, cameras)
        rows = (torch.cat(list(pictures), 1) for pictures in (views.coloured, views.plain))
        return torch.cat(list(rows)).clamp(0, 1).cpu().numpy()

    def metadata(self) -> dict[str, str]:
        text, _ = prompts(self.config, self.thing)
        known = {"text": text, "text_key": text, "text_model": self.model.name}
        known |= {"text_model_key": self.model.name, "exemplar": str(self.config.text)}
        if self.mesh is not None:
            key = content_key(self.mesh.vertices, self.mesh.faces)
            known |= {"mesh": self.mesh.name, "mesh_key": key}
        return {"method": "nca", "maps": ",".join(MAPS)} | known | self.lineage


def training_mesh(mesh: Mesh, look: Look) -> TrainingSphere:
    """A mesh of any shape to train on, at the size of the spheres, as finely divided as when the texture is
    applied to it.
    """
    return TrainingSphere.of(Cells.of(mesh.normalised()[0]).mesh, look)


def _edges(mesh: Mesh, device: torch.device | str) -> tuple[torch.Tensor, torch.Tensor]:
    rows, neighbours = mesh.edges.rows, mesh.edges.indices
    return torch.tensor(rows, device=device), torch.tensor(neighbours, device=device)
