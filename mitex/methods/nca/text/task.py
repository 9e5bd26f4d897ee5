"""The training of a look from words as a task for the loop (MeshNCA, section 4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
import torch

from mitex.cache import content_key
from mitex.features.text_image import TextImageModel
from mitex.losses import laplacian_excess, overflow_loss
from mitex.mesh import Mesh
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.pool import PoolTask, initial_look
from mitex.methods.nca.surfaces import TrainingMesh, TrainingSurface, training_surfaces
from mitex.methods.nca.text.views import Figure, training_cameras
from mitex.methods.nca.text.wording import MAPS, prompts
from mitex.methods.words.distance import Negative, Part, Sight, SightBank, WordsDistance
from mitex.progress import announce
from mitex.runtime import keep_freed_memory
from mitex.scenes.cameras import orbit

PREVIEW = 256  # side of a preview's pictures [px]


class TextTask(PoolTask):
    """Trains a look to be what words say, in the eyes of a vision-language model.

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
        device = config.device
        keep_freed_memory()
        self.mesh = mesh
        self.thing = config.text_object or ("sphere" if mesh is None else mesh.name)
        text, negative = prompts(config, self.thing)
        self.words = WordsDistance(model, text, negative, config.text_directional)
        announce("preparing what is trained on")
        look = initial_look(config, MAPS, init, device)
        surfaces = training_surfaces(config, look) if mesh is None else [training_mesh(mesh, look)]
        super().__init__(config, look, surfaces, lineage)
        self.meshes = [surface for surface in surfaces if isinstance(surface, TrainingMesh)]
        self.figures = {surface: Figure(surface, config.text_relief, device) for surface in self.meshes}
        self._edges = {surface: _edges(surface.mesh, device) for surface in self.meshes}
        self.banks = {surface: self._bank(surface) for surface in self.meshes}

    def _bank(self, surface: TrainingMesh) -> SightBank:
        config, figure = self.config, self.figures[surface]
        return SightBank(config, partial(training_cameras, config, surface), self.words, figure.bare)

    def terms(
        self, surface: TrainingSurface, state: torch.Tensor, generator: torch.Generator
    ) -> dict[str, torch.Tensor]:
        assert isinstance(surface, TrainingMesh)
        config, bank = self.config, self.banks[surface]
        index = bank.draw(generator)
        sight = bank.sight(index)
        views = self.figures[surface].textured(self.look, state, sight.cameras)
        excess = laplacian_excess(2 * views.height - 1, *self._edges[surface], config.text_roughness)
        return self.distances(sight, bank.negative(index), views.coloured, views.plain) | {
            "rough": config.text_smooth_weight * excess,
            "range": config.text_range_weight * overflow_loss(2 * views.values - 1),
        }

    def distances(
        self, sight: Sight, bare: Negative, coloured: torch.Tensor, plain: torch.Tensor
    ) -> dict[str, torch.Tensor]:
        """Of pictures (K, H, W, 3), coloured and grey, from the text, by part."""
        config = self.config
        return self.words(
            {
                "whole": Part(config.text_whole_weight, sight.whole, coloured, bare.whole),
                "close": Part(config.text_close_weight, sight.close, coloured, bare.close),
                "relief": Part(config.text_relief_weight, sight.close, plain, bare.close),
            }
        )

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """Two views of an evolved state, coloured, and grey below."""
        surface, state, _ = self.example(step)
        assert isinstance(surface, TrainingMesh)
        cameras = orbit(2, distance=2.05, resolution=PREVIEW, start=90)
        views = self.figures[surface].textured(self.look, state, cameras)
        rows = (torch.cat(list(pictures), 1) for pictures in (views.coloured, views.plain))
        return torch.cat(list(rows)).clamp(0, 1).cpu().numpy()

    def metadata(self) -> dict[str, str]:
        text, _ = prompts(self.config, self.thing)
        known = {"text": text, "text_key": text, "text_model": self.words.model.name}
        known |= {"text_model_key": self.words.model.name, "exemplar": str(self.config.text)}
        if self.mesh is not None:
            key = content_key(self.mesh.vertices, self.mesh.faces)
            known |= {"mesh": self.mesh.name, "mesh_key": key}
        return {"method": "nca", "maps": ",".join(MAPS)} | known | self.lineage


def training_mesh(mesh: Mesh, look: Look) -> TrainingMesh:
    """A mesh of any shape to train on, at the size of the spheres, as finely divided as when the texture is
    applied to it.
    """
    return TrainingMesh.of(Cells.of(mesh.normalised()[0]).mesh, look)


def _edges(mesh: Mesh, device: torch.device | str) -> tuple[torch.Tensor, torch.Tensor]:
    rows, neighbours = mesh.edges.rows, mesh.edges.indices
    return torch.tensor(rows, device=device), torch.tensor(neighbours, device=device)
