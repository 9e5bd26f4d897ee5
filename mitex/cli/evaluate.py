"""`mitex evaluate`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from mitex.errors import ConfigError

if TYPE_CHECKING:
    from mitex.asset import Asset


@dataclass
class Evaluate:
    """Measure an asset: how near its texture comes to an exemplar or a relief, or how well it fits words.

    With --exemplar, patches of the surface are compared with the picture: Frechet distances, transport, Gram
    matrices, seams and repetition, as in the reports of `mitex compare`. With --reference, the form and the
    local statistics of its relief are compared with those of a mesh. With --text, a vision-language model
    looks at it from 24 sides: MES (multi-view expert score, how well it fits) and MES-dir (the same of its
    change from grey), as in the MeshNCA paper; more is better. Take another model than the one that it was
    trained with.

    examples:
      mitex evaluate vase.glb --exemplar lava
      mitex evaluate spiky.glb --reference spikes
      mitex evaluate dots.glb --text "red dots on white" --object vase --judge models/clip-b16
    """

    asset: Annotated[Positional[Path], arg(metavar="ASSET")]
    """File written by `mitex apply` (.glb .obj .ply)."""

    exemplar: Annotated[str | None, arg(metavar="IMAGE|DIR|NAME", help_behavior_hint="")] = None
    """Picture that the texture was made from."""

    reference: Annotated[str | None, arg(metavar="MESH|NAME", help_behavior_hint="")] = None
    """Mesh, or reference by formula, that its relief was made from."""

    text: Annotated[str | None, arg(metavar="WORDS", help_behavior_hint="")] = None
    """What it shall be made of."""

    object: Annotated[str | None, arg(metavar="WORD", help_behavior_hint="(default: object)")] = None
    """What the words call the object."""

    judge: Annotated[str | None, arg(metavar="DIR|NAME", help_behavior_hint="(default: as of `fit`)")] = None
    """CLIP folder that scores it, or `words` for the small model that ships with Mitex."""

    json: Annotated[bool, arg(help_behavior_hint="")] = False
    """For programs: a JSON object."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        if self.exemplar is None and self.reference is None and self.text is None:
            raise ConfigError("nothing to compare it with", "give --exemplar, --reference or --text")
        for option, value in (("--object", self.object), ("--judge", self.judge)):
            if value is not None and self.text is None:
                raise ConfigError(f"{option} belongs to --text", "give both, or none")
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        numbers = {**self._likeness(), **self._relief(), **self._fit_of_words()}
        if self.json:
            print(json.dumps({label: value for label, (value, _) in numbers.items()}, indent=2))
            return
        for label, (value, better) in numbers.items():
            print(f"{label:18}  {value:9.4g}  {better}")

    @cached_property
    def _loaded(self) -> Asset:
        from mitex.asset import Asset

        return Asset.load(self.asset)

    def _likeness(self) -> dict[str, tuple[float, str]]:
        """Numbers beside the exemplar: label -> value, and which way better lies."""
        if self.exemplar is None:
            return {}
        from mitex.comparison.look_pair import LookPair

        return _labelled(LookPair(self.exemplar, str(self.asset)).numbers(self._loaded))

    def _relief(self) -> dict[str, tuple[float, str]]:
        """Numbers beside the reference, as `_likeness`."""
        if self.reference is None:
            return {}
        from mitex.comparison.relief_pair import ReliefPair

        return _labelled(ReliefPair(self.reference, str(self.asset)).numbers(self._loaded))

    def _fit_of_words(self) -> dict[str, tuple[float, str]]:
        """Scores beside the words, as `_likeness`."""
        if self.text is None:
            return {}
        import torch

        from mitex.asset import clay
        from mitex.evaluation.text import text_scores
        from mitex.features.text_image import object_prompt
        from mitex.features.text_model import text_image_model
        from mitex.render.sides import sides

        model, thing = text_image_model(self.judge), self.object or "object"
        prompt = object_prompt(self.text, thing)
        model.encode_texts([prompt, thing])  # before it takes the time of pictures: unknown words are refused
        shown = (self._loaded, clay(self._loaded.mesh))
        textured, bare = (torch.from_numpy(sides(asset, model.resolution)) for asset in shown)
        scores = text_scores(model, textured, bare, prompt, thing)
        return {"MES": (scores.score, "high is better"), "MES-dir": (scores.direction, "high is better")}


def _labelled(numbers: Mapping[str, float]) -> dict[str, tuple[float, str]]:
    """The numbers of a comparison by their labels, with which way better lies."""
    from mitex.comparison.measures import BY_KEY

    return {BY_KEY[key].label: (value, BY_KEY[key].better) for key, value in numbers.items()}
