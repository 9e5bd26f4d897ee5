"""What words ask of texels: views of the mesh, and how far they are from what the words say."""

from __future__ import annotations

import torch
import torch.nn.functional as F

from mitex.features.text_image import TextImageModel
from mitex.methods.surface.config import SurfaceConfig
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.words.distance import Part, SightBank, WordsDistance
from mitex.scenes.cameras import Cameras, patch_views, random_views
from mitex.scenes.shaded import GREY, lamps_of_pixels, pictured, shading
from mitex.scenes.stage import Hits, Stage
from mitex.sparse import LinearMap, Weights


class Figure:
    """The mesh of a domain as cameras see it, shaded, with the colours of its texels.

    Args:
        domain: the mesh and its texels.
        background: sRGB around it.
    """

    def __init__(self, domain: SurfaceDomain, background: float) -> None:
        self.ball = domain.mesh.normalised()[0]
        self._texels, self._stage, self._background = domain.texels, Stage(self.ball), background
        self._spread = LinearMap(domain.levels.spread)
        self._faces, self._normals = torch.tensor(self.ball.faces), torch.tensor(self.ball.normals)

    def textured(self, cameras: Cameras, colours: torch.Tensor) -> torch.Tensor:
        """Pictures (K, H, W, 3) sRGB of colours (n, 3) in the order of the levels, in which they are
        differentiable.
        """
        hits = self._stage.hits(cameras)
        index, weight = self._texels.bilinear(hits.face.numpy(), hits.barycentric.numpy())
        lookup = Weights(torch.from_numpy(index), torch.from_numpy(weight), len(self._texels.index))
        return self._shaded(cameras, hits, lookup(self._spread(colours)))

    def bare(self, cameras: Cameras) -> torch.Tensor:
        """Pictures (K, H, W, 3) sRGB of the mesh in grey."""
        hits = self._stage.hits(cameras)
        return self._shaded(cameras, hits, torch.full((len(hits.face), 1), GREY))

    def _shaded(self, cameras: Cameras, hits: Hits, colours: torch.Tensor) -> torch.Tensor:
        corners = self._faces[hits.face.long()]
        normals = F.normalize(Weights(corners, hits.barycentric, len(self._normals))(self._normals), dim=1)
        shade = shading(normals, lamps_of_pixels(cameras, hits.hit))
        return pictured(shade * colours, hits.hit, cameras, self._background)


class Words:
    """A text, in the eyes of a vision-language model, and the views of a mesh that are compared with it.

    Args:
        config: settings, `text` among them.
        model: the frozen model.
        domain: the mesh and its texels.

    Raises:
        ConfigError: the text says no more than the name of the mesh, or what the model does not know.
    """

    def __init__(self, config: SurfaceConfig, model: TextImageModel, domain: SurfaceDomain) -> None:
        self.config, self.prompt = config, config.prompt(domain.mesh.name)
        thing = config.text_object or domain.mesh.name
        self.distance = WordsDistance(
            model, self.prompt, thing, config.text_directional, config.text_background
        )
        self.figure = Figure(domain, config.text_background)
        self.bank = SightBank(config, self._cameras, self.distance, self.figure.bare)

    def terms(self, colours: torch.Tensor, generator: torch.Generator) -> dict[str, torch.Tensor]:
        """The weighted distances of whole views and of close-ups, of one of the bank's sets of views.

        Args:
            colours: (n, 3) sRGB, in the order of the levels.
            generator: source of all randomness.
        """
        config = self.config
        index = self.bank.draw(generator)
        sight = self.bank.sight(index)
        pictures = self.figure.textured(sight.cameras, colours)
        bare = self.bank.negative(index) if config.text_directional else None
        return self.distance(
            {
                "whole": Part(config.text_whole_weight, sight.whole, pictures, bare and bare.whole),
                "close": Part(config.text_close_weight, sight.close, pictures, bare and bare.close),
            }
        )

    def metadata(self) -> dict[str, str]:
        """What a resumed run must share."""
        model = self.distance.model.name
        known = {"text": self.prompt, "text_key": self.prompt}
        return known | {"text_model": model, "text_model_key": model}

    def _cameras(self, generator: torch.Generator) -> Cameras:
        config, count, side = self.config, self.config.text_views, self.config.text_view
        if not config.text_width:
            return random_views(generator, count, config.text_distance, resolution=side)
        half = 0.5 * config.scale * config.text_width
        return patch_views(generator, self.figure.ball, count, half, side)
