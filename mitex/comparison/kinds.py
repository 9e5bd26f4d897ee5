"""Kinds of comparisons, by what the methods learn from: what is measured then, and how."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from mitex.asset import Asset
from mitex.comparison.measures import CAPTURES, COSTS, LOOKS, RELIEFS, TEXTS, Measure
from mitex.lazy import load


class Pair(Protocol):
    """An exemplar in the widest sense (what is learned from), and a mesh, or none where `Kind.meshless`: all
    that is needed to measure results on them, whatever the method."""

    @property
    def key(self) -> str:
        """A hash of both."""
        ...

    @property
    def judge(self) -> str | None:
        """Name of the model that judges; None where that is always the same one, or none."""
        ...

    @property
    def image(self) -> np.ndarray | None:
        """(S, S, 3) sRGB in [0, 1]: what is learned from; None if that has no picture."""
        ...

    def numbers(self, asset: Asset | None, run: Path) -> dict[str, float]:
        """What is measured of an asset, if there is a mesh, and the run that it is from; NaN, or nothing,
        where that is not possible."""
        ...

    def floor(self) -> dict[str, float]:
        """The noise floor: the same of what is learned from, beside itself, as far as that is known."""
        ...

    def pictures(self, asset: Asset | None, run: Path) -> dict[str, np.ndarray]:
        """(N, N, 3) sRGB in [0, 1] each: `LIT`, the asset in light, and `VIEW`, as far as there is one."""
        ...


@dataclass(frozen=True)
class Kind:
    """A kind of comparison.

    Attributes:
        measures: what results have.
        pair: reference to the class of its pairs.
        conditions: what was the same for all, besides inputs and pictures.
        judged: whether there is a choice of the model that judges.
        meshless: whether something is measured of textures that are put on no mesh, too.
    """

    measures: tuple[Measure, ...]
    pair: str
    conditions: tuple[str, ...]
    judged: bool = False
    meshless: bool = False

    def pair_of(self, exemplar: str, mesh: str | None, judge: str | None = None) -> Pair:
        """What results are measured with.

        Args:
            exemplar, mesh: paths, names or words; no mesh only where `meshless`.
            judge: CLIP folder, as of `mitex.features.text_model.text_image_model`, where there is a choice.

        Raises:
            MitexError: One of them cannot be read.
        """
        return load(self.pair)(exemplar, mesh, **({"judge": judge} if self.judged else {}))


SIZE = (
    "The size of the pattern: the exemplar is half as wide as the side of the UV layout's square, as far as "
    "the settings of the methods leave it at that."
)
KINDS: Mapping[str, Kind] = {
    "exemplar": Kind(
        (*LOOKS, *COSTS),
        "mitex.comparison.look_pair:LookPair",
        (
            SIZE,
            "What is measured: colours alone, read off the asset that mitex apply wrote, without light, by "
            "the same cameras: 16 patches of the surface, three eighths of the exemplar wide, with as many "
            "pixels as there, beside as many patches of the exemplar, of which the same pixels count.",
            "Pixels that are seen at more than 60 degrees from the normal, or beside the mesh, do not count.",
        ),
    ),
    "text": Kind(
        (*TEXTS, *COSTS),
        "mitex.comparison.text_pair:TextPair",
        ("What is measured: the same 24 views of the object in light, and of the object in grey.",),
        judged=True,
    ),
    "reference": Kind(
        (*RELIEFS, *COSTS),
        "mitex.comparison.relief_pair:ReliefPair",
        (
            "What is measured: the surface that mitex apply wrote, and four views of it in grey, in the same "
            "light as the reference.",
        ),
    ),
    "capture": Kind(
        (*CAPTURES, *COSTS),
        "mitex.comparison.capture_pair:CapturePair",
        (
            "What is measured: the texture itself, not the file that mitex apply wrote. Cameras of photos "
            "look at planes that wear it, in the capture's light as the method knows it. The same pixels "
            "count in both. The distance is not the paper's SIFID, whose network is another.",
            "The mesh is for the pictures alone: what is solid on it, in the light of the studio. There haze "
            "is left out, and what shines keeps the colour that it has from the front.",
            "Views held out: every eighth photo, from which no method has learned, beside the captured "
            "object as its camera sees it, at most 400 pixels wide and high. What is put on no mesh has "
            "these numbers alone; they stand beside those of the others on each mesh.",
        ),
        meshless=True,
    ),
}
