"""The synthesis of a texture on a surface as a task for the loop (Kovacs et al. 2024, section 3.4)."""

from __future__ import annotations

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.features.vgg import LAYERS, Weights, convolutions
from mitex.losses import gram_distance
from mitex.methods.surface.config import SurfaceConfig
from mitex.methods.surface.levels import Levels
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.statistics import exemplar_grams
from mitex.methods.surface.texels import Texels
from mitex.methods.surface.texture import texel_layout
from mitex.pictures import CYCLE, picture_images, pictures_of
from mitex.runtime import keep_freed_memory


class SurfaceTask:
    """Texels whose features shall have the Gram matrices of the exemplar's.

    With several maps, a step looks at some pictures of them in turn (see `mitex.pictures`): the mixed ones
    tie the maps together.

    Attributes:
        values: (N, C) leaf, the maps' channels by `layout`, in the order of `levels`, in [0, 1].

    Args:
        config: settings.
        exemplar: maps to match.
        texels, levels: of the surface.
        mesh: what tells it from other meshes, for a resumed run.
        content: (N, 3) sRGB in [0, 1] in the order of `texels`, whose structure shall stay while the look
            becomes the exemplar's (style transfer). The synthesis starts from it.

    Raises:
        ConfigError: a content for more than the albedo, or on several scales.
    """

    def __init__(
        self,
        config: SurfaceConfig,
        exemplar: Exemplar,
        texels: Texels,
        levels: Levels,
        mesh: str = "",
        content: np.ndarray | None = None,
    ) -> None:
        keep_freed_memory()
        self.config, self.exemplar, self.texels, self.levels = config, exemplar, texels, levels
        self.mesh = mesh
        if content is not None and (list(exemplar.maps) != ["albedo"] or config.scales):
            raise ConfigError(
                "style transfer takes one image and one scale", "give an image as --exemplar, and scales=0"
            )
        self.layout = texel_layout(list(exemplar.maps))
        self.pictures = pictures_of(self.layout, True, config.seed)
        generator = torch.Generator().manual_seed(config.seed)
        self.values = self._start(generator).requires_grad_()
        weights = random_weights(generator) if config.weights == "random" else None
        # The image network has the same weights: what differs is only where it looks.
        image_network = Vgg16(config.pooling, normalised=False, weights=weights)
        self.networks, self.targets = [], []
        for scale in range(config.scales + 1):
            self.networks.append(
                SurfaceVgg(
                    levels,
                    config.pooling,
                    bilinear=config.bilinear,
                    scale=scale,
                    weights=weights,
                )
            )
            shown = exemplar.resized(max(config.exemplar_size >> scale, 16))
            images = torch.from_numpy(picture_images(shown, self.pictures, self.layout))
            self.targets.append([exemplar_grams(image_network, image, config.layers) for image in images])
        self.content: torch.Tensor | None = None
        if content is not None:
            start = torch.from_numpy(content[levels.order].astype(np.float32))
            with torch.no_grad():
                self.values.copy_(start)
                self.content = self.networks[0].features(start, [config.content_layer])[config.content_layer]

    @property
    def parameters(self) -> list[torch.Tensor]:
        return [self.values]

    def loss(self, step: int, generator: torch.Generator) -> tuple[torch.Tensor, dict[str, float]]:
        scale = self.scale(step)
        chosen = self._chosen(step, generator)
        total = torch.zeros(())
        for k in chosen:
            colours = self.values[:, self.pictures[k].channels]
            whole = () if self.content is None else (self.config.content_layer,)
            grams, features = self.networks[scale].compared(colours, self.config.layers, whole)
            total = total + gram_distance(grams, self.targets[scale][k]) / len(self.config.layers)
            if self.content is not None:
                difference = features[self.config.content_layer] - self.content
                total = total + self.config.content_weight * difference.square().mean()
        return total / len(chosen), {"scale": float(scale)}

    def scale(self, step: int) -> int:
        """How often the texels are pooled before the network sees them in a step."""
        coarse = round(self.config.coarse_share * self.config.steps) if self.config.scales else 0
        return 0 if step >= coarse else self.config.scales - step * self.config.scales // coarse

    def commit(self) -> None:
        with torch.no_grad():
            self.values.clamp_(0.0, 1.0)

    def state(self) -> dict[str, torch.Tensor]:
        return {"values": self.values}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        with torch.no_grad():
            if state["values"].shape != self.values.shape:
                raise ValueError(f"texels of shape {tuple(state['values'].shape)}")
            self.values.copy_(state["values"])

    def images(self) -> dict[str, np.ndarray]:
        """The maps so far: name -> (R, R, c) float32, row 0 on top; unused texels are 0."""
        image = self.texels.image(self.in_texel_order())
        return {name: image[..., channels] for name, channels in self.layout.items()}

    def in_texel_order(self) -> np.ndarray:
        """(N, C) values in the order of `Texels`."""
        values = np.empty(tuple(self.values.shape), np.float32)
        values[self.levels.order] = self.values.detach().numpy()
        return values

    def preview(self, step: int) -> np.ndarray:
        """The exemplar's pictures beside those of the texture."""
        size = self.config.resolution
        whole = Exemplar(self.images())
        exemplar = self.exemplar.resized(min(self.config.exemplar_size, size))
        rows = []
        for picture in (p for p in self.pictures if p.kind != "mix"):
            left = np.ones((size, exemplar.size[1], 3), np.float32)
            left[: exemplar.size[0]] = picture_images(exemplar, [picture], self.layout)[0]
            rows.append(np.concatenate([left, picture_images(whole, [picture], self.layout)[0]], 1))
        return np.concatenate(rows, 0)

    def metadata(self) -> dict[str, str]:
        maps = ",".join(self.layout)
        return {"method": "surface", "maps": maps, "exemplar": self.exemplar.name, "mesh": self.mesh}

    def _start(self, generator: torch.Generator) -> torch.Tensor:
        means = [self.exemplar.maps[name].mean((0, 1)) for name in self.layout]
        mean = torch.from_numpy(np.concatenate(means))
        noise = self.config.noise * torch.rand(len(self.levels.order), len(mean), generator=generator)
        return (noise + mean - self.config.noise / 2).clamp(0, 1) if self.config.mean_start else noise

    def _chosen(self, step: int, generator: torch.Generator) -> list[int]:
        """The pictures of a step: kinds in turn, any of a kind."""
        kinds = [kind for kind in CYCLE if any(p.kind == kind for p in self.pictures)]
        count = min(self.config.pictures, len(kinds))
        return [self._one(kinds[(step * count + k) % len(kinds)], generator) for k in range(count)]

    def _one(self, kind: str, generator: torch.Generator) -> int:
        of_kind = [k for k, p in enumerate(self.pictures) if p.kind == kind]
        return of_kind[int(torch.randint(len(of_kind), (), generator=generator))]


def random_weights(generator: torch.Generator) -> Weights:
    """Weights of the network's shape, drawn as He et al. do, without biases (figure 5 b)."""
    drawn = {}
    for name in LAYERS:
        weight, bias = convolutions("average", False)[name]
        scale = (2.0 / weight[0].numel()) ** 0.5
        drawn[name] = torch.randn(weight.shape, generator=generator) * scale, torch.zeros_like(bias)
    return drawn
