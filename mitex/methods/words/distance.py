"""How far views of a surface are from what words say, in the eyes of a vision-language model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import torch
import torch.nn.functional as F

from mitex.errors import ConfigError
from mitex.features.text_image import TextImageModel
from mitex.losses import Augmentation, directional_distance, mean_direction, text_distance
from mitex.scenes.cameras import Cameras
from mitex.scenes.shaded import BACKGROUND

SAME = 1e-4  # squared distance of the unit embeddings of texts that mean the same


class BankConfig(Protocol):
    """The settings of a bank of sights, and of what is cut out of their views."""

    @property
    def seed(self) -> int: ...
    @property
    def text_bank(self) -> int: ...
    @property
    def text_crops(self) -> int: ...
    @property
    def text_crop_area(self) -> float: ...
    @property
    def text_tilt(self) -> float: ...


@dataclass(frozen=True, eq=False)
class Sight:
    """K views, and what of them the model sees; drawn once, the same for any texture.

    Attributes:
        cameras: the views.
        whole: all of each view, tilted.
        close: close-ups cut out of the views, tilted.
    """

    cameras: Cameras
    whole: Augmentation
    close: Augmentation

    @staticmethod
    def draw(config: BankConfig, cameras: Cameras, generator: torch.Generator) -> Sight:
        """Of these views."""
        count, tilt = len(cameras), config.text_tilt
        return Sight(
            cameras,
            Augmentation.draw(generator, count, tilt=tilt),
            Augmentation.draw(generator, count, config.text_crops, config.text_crop_area, tilt),
        )


@dataclass(frozen=True, eq=False)
class Negative:
    """What a sight of the surface without its texture is to the model: mean directions (D,) of the whole
    views and of the close-ups.
    """

    whole: torch.Tensor
    close: torch.Tensor


@dataclass(frozen=True, eq=False)
class Part:
    """Something that shall be what the words say.

    Attributes:
        weight: of its distance.
        cut: what of the pictures the model sees.
        pictures: (K, H, W, 3) sRGB.
        negative: (D,) the same of a `Negative`; needed for directions alone.
    """

    weight: float
    cut: Augmentation
    pictures: torch.Tensor
    negative: torch.Tensor | None


class WordsDistance:
    """A text that pictures are compared with.

    Args:
        model: the frozen model.
        text: what is wanted.
        thing: what the negatives show, in words.
        directional: compare the step from the negatives to the pictures with that from `thing` to the text
            (MeshNCA, equation 9); else the pictures with the text.
        background: sRGB around the surface, and around the pictures.

    Attributes:
        text, negative: (D,) directions of the texts; the second one counts in steps from it alone.

    Raises:
        ConfigError: the text says no more than `thing`, or what the model does not know.
    """

    def __init__(
        self,
        model: TextImageModel,
        text: str,
        thing: str,
        directional: bool,
        background: float = BACKGROUND,
    ) -> None:
        self.model, self.directional, self._background = model, directional, background
        texts = model.encode_texts([text, thing if directional else text])
        self.text, self.negative = F.normalize(texts, dim=1)
        if directional and (self.text - self.negative).square().sum() < SAME:
            raise ConfigError(f"'{text}' means no more than '{thing}'", "say more about the texture")

    @torch.no_grad()
    def bare(self, sight: Sight, pictures: torch.Tensor) -> Negative:
        """What the surface without its texture is, of which the pictures (K, H, W, 3) of a sight are."""
        squares = [self._squares(cut, pictures) for cut in (sight.whole, sight.close)]
        return Negative(*self.directions(squares))

    def __call__(self, parts: Mapping[str, Part]) -> dict[str, torch.Tensor]:
        """The weighted distance of each part that has a weight; all are encoded at once."""
        parts = {name: part for name, part in parts.items() if part.weight}
        squares = [self._squares(part.cut, part.pictures) for part in parts.values()]
        return {
            name: part.weight * self._distance(direction, part.negative)
            for (name, part), direction in zip(parts.items(), self.directions(squares), strict=True)
        }

    def directions(self, groups: list[torch.Tensor]) -> list[torch.Tensor]:
        """The mean direction (D,) of each group of pictures (N, R, R, 3), all encoded at once."""
        embeddings = self.model.encode_images(torch.cat(groups))
        return [mean_direction(part) for part in embeddings.split([len(group) for group in groups])]

    def _squares(self, cut: Augmentation, pictures: torch.Tensor) -> torch.Tensor:
        return cut(pictures, self.model.resolution, self._background)

    def _distance(self, pictures: torch.Tensor, negative: torch.Tensor | None) -> torch.Tensor:
        if self.directional:
            assert negative is not None
            return directional_distance(pictures, negative, self.text, self.negative)
        return text_distance(pictures, self.text)


class SightBank:
    """Sights of one surface that are drawn once, of which a step sees one, and what is seen of it bare.

    Args:
        config: settings.
        cameras: draws the views of a sight.
        words: what the sights are for.
        bare: pictures (K, H, W, 3) of the surface without its texture, by the views.
    """

    def __init__(
        self,
        config: BankConfig,
        cameras: Callable[[torch.Generator], Cameras],
        words: WordsDistance,
        bare: Callable[[Cameras], torch.Tensor],
    ) -> None:
        self._config, self._cameras, self._words, self._bare = config, cameras, words, bare
        self._negatives: dict[int, Negative] = {}

    def draw(self, generator: torch.Generator) -> int:
        """The number of a sight."""
        return int(torch.randint(self._config.text_bank, (), generator=generator))

    def sight(self, index: int) -> Sight:
        """By its number, the same whenever it is asked for."""
        seed = self._config.seed * self._config.text_bank + index
        generator = torch.Generator().manual_seed(seed)
        return Sight.draw(self._config, self._cameras(generator), generator)

    def negative(self, index: int) -> Negative:
        """Of a sight, computed when it is wanted first."""
        if index not in self._negatives:
            sight = self.sight(index)
            self._negatives[index] = self._words.bare(sight, self._bare(sight.cameras))
        return self._negatives[index]
