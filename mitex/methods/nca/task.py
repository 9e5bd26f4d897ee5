"""The image-guided training as a task for the loop (MeshNCA, section 4.1; Cells2Pixels, section 3.3)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
import torch.nn.functional as F

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.methods.nca.appearance import Appearance
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.pool import PoolTask, initial_look
from mitex.methods.nca.relief import Relief
from mitex.methods.nca.surfaces import (
    LEAST,
    CloseUps,
    TrainingMesh,
    TrainingPlane,
    TrainingSurface,
    training_surfaces,
)
from mitex.methods.nca.targets import Targets, enlarged
from mitex.progress import announce
from mitex.runtime import keep_freed_memory
from mitex.scenes.cameras import Cameras, random_views
from mitex.triples import channel_triples, triple_images

SMALLEST = 128  # side of the exemplar at the coarsest zoom [px], at least: a quarter is left at relu3_1
PREVIEW = 256  # side of a preview's pictures [px]


class NcaTask(PoolTask):
    """Trains a look: states from a pool evolve on surfaces, and their views are compared at several zooms.

    Args:
        config: settings.
        exemplar: maps to learn.
        init: what to start from; None draws new weights from the seed.
        lineage: name of the model to start from, and its family, for the checkpoint.
    """

    def __init__(
        self,
        config: NcaConfig,
        exemplar: Exemplar,
        init: Look | None = None,
        lineage: Mapping[str, str] | None = None,
    ) -> None:
        keep_freed_memory()
        announce("preparing surfaces and the exemplar")
        self.exemplar = exemplar.resized(min(config.exemplar_size, *exemplar.size))
        self.maps = sorted(exemplar.maps)
        look = initial_look(config, self.maps, init, config.device)
        super().__init__(config, look, training_surfaces(config, look), lineage)
        self.zooms = self._appearances()
        self.relief = None
        if config.relief_weight and {"height", "normal"} <= exemplar.maps.keys():
            self.relief = Relief(self.exemplar, self.look.layout, self.zooms)

    def _appearances(self) -> dict[int, Appearance]:
        """Size of the exemplar [px] -> comparison with it at that size; from the coarsest on."""
        config, network = self.config, Vgg16(self.config.pooling, device=str(self.look.device))
        layout = self.look.layout
        pictures = channel_triples(layout, config.blend, config.seed)
        finest = self.exemplar.size[0]
        zooms = {}
        for halvings in reversed(range(config.zooms)):
            size = finest >> halvings
            if size < SMALLEST and halvings:
                continue
            target = enlarged(self.exemplar.resized(size), config.target_size or size)
            targets = Targets(target, pictures, layout, network, config.layers)
            zooms[size] = Appearance(config, targets, network, ordered=not zooms)
        return zooms

    def terms(
        self, surface: TrainingSurface, state: torch.Tensor, generator: torch.Generator
    ) -> dict[str, torch.Tensor]:
        terms: dict[str, list[torch.Tensor]] = {"appearance": [], "relief": []}
        for size, appearance in self.zooms.items():
            views = self.views(surface, state, size, generator)
            terms["appearance"].append(appearance(views, generator))
            if self.relief and isinstance(surface, TrainingPlane):  # on spheres, "right" turns in a view
                terms["relief"].append(self.config.relief_weight * self.relief(views, size))
        return {name: torch.stack(values).mean() for name, values in terms.items() if values}

    def views(
        self, surface: TrainingSurface, state: torch.Tensor, size: int, generator: torch.Generator
    ) -> torch.Tensor:
        """The views (K, H, W, C) of one step in which the exemplar is `size` [px] wide."""
        if isinstance(surface, TrainingMesh):
            return surface.views(self.look, state, self.cameras(surface, size, generator))
        return surface.patches(self.look, state, self.closeups(size), generator)

    def cameras(
        self, surface: TrainingMesh, size: int, generator: torch.Generator, least: int = LEAST
    ) -> Cameras:
        """The cameras of `views`."""
        config = self.config
        if config.views == "full":
            return random_views(generator, config.view_count, config.distance, config.fov, config.resolution)
        return surface.cameras(self.closeups(size, least), generator)

    def closeups(self, size: int, least: int = LEAST) -> CloseUps:
        """Those of one step in which the exemplar is `size` [px] wide."""
        config = self.config
        width = config.density * config.resolution / size
        return CloseUps(width, config.view_count, config.resolution, least=least)

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """For each map a row: the exemplar, a patch as wide, a quarter of that, and the whole surface of an
        evolved state.
        """
        (surface, state, generator), look = self.example(step), self.look
        views = [
            surface.patches(look, state, CloseUps(width, 1, PREVIEW, antialias=2), generator)[0]
            for width in (self.config.density, self.config.density / 4)
        ]
        views = [_padded(view, PREVIEW) for view in (*views, surface.whole(look, state, PREVIEW))]
        triples = channel_triples(self.look.layout, False, 0)
        images = triple_images(self.exemplar.resized(PREVIEW), triples, self.look.layout)
        rows = [
            np.concatenate([image, *(view[..., triple.channels] for view in views)], 1)
            for image, triple in zip(images, triples, strict=True)
        ]
        return np.clip(np.concatenate(rows), 0, 1)

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        return {"method": "nca", "maps": ",".join(self.maps)} | exemplar | self.lineage


def _padded(view: torch.Tensor, side: int) -> np.ndarray:
    """A square view (h, h, C) in the middle of (side, side, C) zeros."""
    before = (side - len(view)) // 2
    after = side - len(view) - before
    return F.pad(view, (0, 0, before, after, before, after)).cpu().numpy()
