"""`mitex models`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from mitex.methods.registry import bundled, methods

THUMBNAILS = (".png", ".jpg")


@dataclass
class Models:
    """List the textures that ship with Mitex; use their names with `mitex apply`.

    examples:
      mitex models
      mitex models --json
      mitex models --like "grey pebbles"
    """

    json: Annotated[bool, arg(help_behavior_hint="")] = False
    """For programs: a JSON list of objects."""

    like: Annotated[str | None, arg(metavar="WORDS", help_behavior_hint="")] = None
    """The most similar first, by a small model of pictures and words: it knows common colours, patterns and
    materials, and says so when it does not know a word."""

    def run(self) -> None:
        models = listing()
        if self.like is not None:
            models = _by_likeness(models, self.like)
        if self.json:
            print(json.dumps(models, indent=2))
            return
        for model in models:
            keys = ("likeness", "preset", "steps", "seconds", "loss")
            origin = [f"{key} {_text(model[key])}" for key in keys if key in model]
            print(f"{model['name']:16}  {model['method']}: {', '.join(model.get('maps', ['relief']))}")
            print(f"{'':16}  {', '.join(origin)}")
            if model["thumbnail"]:
                print(f"{'':16}  {model['thumbnail']}")
        for family, names in _families(models).items():
            print(f"family {family}, which can be grafted with each other: {', '.join(names)}")


def _by_likeness(models: list[dict[str, Any]], text: str) -> list[dict[str, Any]]:
    """The models whose thumbnails fit a text best first; those without one last."""
    from mitex.features.words import likeness
    from mitex.images import read_image

    with_thumbnail = [model for model in models if model["thumbnail"]]
    cosines = likeness(text, [read_image(model["thumbnail"]) for model in with_thumbnail])
    fits = [model | {"likeness": cosine} for model, cosine in zip(with_thumbnail, cosines, strict=True)]
    fits.sort(key=lambda model: model["likeness"], reverse=True)
    return fits + [model for model in models if not model["thumbnail"]]


def _families(models: list[dict[str, Any]]) -> dict[str, list[str]]:
    """Families of two models or more, and their names."""
    names: dict[str, list[str]] = {}
    for model in models:
        if "family" in model:
            names.setdefault(model["family"], []).append(model["name"])
    return {family: members for family, members in names.items() if len(members) > 1}


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def listing() -> list[dict[str, Any]]:
    """What every bundled model tells: name, method, path, thumbnail or None, maps if any, its training."""
    return [
        {
            **method.load_texture().load(path).about,
            "name": name,
            "method": method.name,
            "path": str(path),
            "thumbnail": _thumbnail(path),
        }
        for method in methods().values()
        for name, path in bundled(method).items()
    ]


def _thumbnail(path: Path) -> str | None:
    pictures = (path.with_suffix(suffix) for suffix in THUMBNAILS)
    return next((str(picture) for picture in pictures if picture.is_file()), None)
