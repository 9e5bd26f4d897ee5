"""The training of colours and offsets of one mesh from words, as a task (Michel et al. 2022, section 3.2)."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np
import torch

from mitex.atlas import Atlas
from mitex.cache import content_key
from mitex.features.text_image import TextImageModel
from mitex.losses import Augmentation, embedding_distance, mean_direction, text_distance
from mitex.mesh import Mesh, subdivide_midpoint
from mitex.methods.neural_style.cameras import cameras_of
from mitex.methods.neural_style.config import StyleConfig
from mitex.methods.neural_style.figure import Figure
from mitex.runtime import keep_freed_memory
from mitex.scenes.cameras import orbit
from mitex.training import ParameterTask, Step

PADDING = 2  # texels by which charts are continued outwards


class StyleTask(ParameterTask):
    """A network that colours and moves a mesh until views of it are what words say.

    A method's own class adds `initial` and `style`, and may do more once this is constructed.

    Args:
        config: settings, `text` among them.
        model: the frozen vision-language model.
        mesh: with the UVs of the texture.

    Attributes:
        text: (1, D) embedding of what is wanted.
        fine: the mesh, with as many vertices as wanted.
        ball: the same, of radius 1 around the origin.

    Raises:
        ConfigError: the text says what the model does not know.
    """

    method: ClassVar[str]

    def __init__(self, config: StyleConfig, model: TextImageModel, mesh: Mesh) -> None:
        keep_freed_memory()
        self.config, self.model, self.mesh = config, model, mesh
        self.prompt = config.prompt(mesh.name)
        self.text = model.encode_texts([self.prompt])
        self.fine = _with_vertices(mesh, config.text_vertices)
        self.ball, self._similarity = self.fine.normalised()
        self.points, self.normals = torch.tensor(self.ball.vertices), torch.tensor(self.ball.normals)
        self.figure = Figure(self.ball, config.text_background)
        super().__init__(self.initial(torch.Generator().manual_seed(config.seed)))

    @abstractmethod
    def initial(self, generator: torch.Generator) -> dict[str, torch.Tensor]:
        """Parameters to begin with."""

    @abstractmethod
    def style(self, step: int | None = None) -> tuple[torch.Tensor, torch.Tensor]:
        """Colours (V, 3) sRGB in (0, 1) of the ball's vertices, and how far they are moved (V, 3) [radii].

        Args:
            step: of the training, which a method may begin with less detail; None: after it.
        """

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Distances from the text of whole views, of close-ups, and of close-ups without colours."""
        config = self.config
        cameras = cameras_of(config, generator)
        colours, offsets = self.style(step)
        coloured, plain = self.figure.pictures(cameras, self.points + offsets, colours)
        count, tilt = config.views, config.text_tilt
        whole = Augmentation.draw(generator, count, tilt=tilt)
        close = Augmentation.draw(generator, count, config.text_crops, config.text_crop_area, tilt)
        parts = {
            "whole": (config.text_whole_weight, whole, coloured),
            "close": (config.text_close_weight, close, coloured),
        }
        if config.text_relief_weight:
            grey = Augmentation.draw(generator, count, config.text_crops, config.text_relief_crop_area, tilt)
            parts["relief"] = config.text_relief_weight, grey, plain
        terms = self._distances(parts)
        return Step(
            torch.stack(list(terms.values())).sum(),
            {name: float(value.detach()) for name, value in terms.items()},
        )

    def _distances(
        self, parts: dict[str, tuple[float, Augmentation, torch.Tensor]]
    ) -> dict[str, torch.Tensor]:
        """The weighted distance of each part that has a weight; all are encoded at once."""
        parts = {name: part for name, part in parts.items() if part[0]}
        size, fill = self.model.resolution, self.config.text_background
        groups = [augmentation(pictures, size, fill) for _, augmentation, pictures in parts.values()]
        embeddings = self.model.encode_images(torch.cat(groups)).split([len(group) for group in groups])
        return {
            name: weight * self._distance(values)
            for (name, (weight, _, _)), values in zip(parts.items(), embeddings, strict=True)
        }

    def _distance(self, embeddings: torch.Tensor) -> torch.Tensor:
        """Of the pictures with these embeddings (N, D), view by view, from the text.

        As published, the n-th close-ups of all views have a mean embedding; the distances of these means are
        averaged here and summed there, which the weights of the presets make up for.
        """
        if self.config.text_each:
            return text_distance(mean_direction(embeddings), self.text[0])
        squares = embeddings.unflatten(0, (self.config.views, -1)).unbind(1)
        return torch.stack([embedding_distance(views, self.text[0]) for views in squares]).mean()

    @torch.no_grad()
    def shape(self) -> Mesh:
        """The mesh with its vertices where they have been moved, in its own units."""
        moved = (self.points + self.style()[1]).numpy()
        return self.fine.with_vertices(self._similarity.inverse(moved))

    @torch.no_grad()
    def baked(self) -> np.ndarray:
        """(R, R, 3) float32 sRGB: the colours of the vertices and between them, as they were trained."""
        assert self.fine.uv is not None
        atlas = Atlas.from_uv(self.fine.uv, self.config.resolution, PADDING)
        return atlas.interpolate(self.style()[0].numpy()[self.fine.faces])

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The mesh from two sides, and the same in grey below."""
        config = self.config
        around = orbit(2, distance=config.distance, fov=config.fov, resolution=config.view, start=90)
        colours, offsets = self.style()
        rows = self.figure.pictures(around, self.points + offsets, colours)
        return np.vstack([np.hstack(list(row.numpy())) for row in rows])

    def metadata(self) -> dict[str, str]:
        known = {"text": self.prompt, "text_key": self.prompt, "exemplar": str(self.config.text)}
        known |= {"text_model": self.model.name, "text_model_key": self.model.name}
        key = content_key(self.mesh.vertices, self.mesh.faces, self.mesh.uv)
        return {"method": self.method, "mesh": self.mesh.name, "mesh_key": key} | known


def _with_vertices(mesh: Mesh, fewest: int) -> Mesh:
    """The mesh, its faces split in four until it has so many vertices."""
    while len(mesh.vertices) < fewest:
        mesh = subdivide_midpoint(mesh)
    return mesh
