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
    """

    json: Annotated[bool, arg(help_behavior_hint="")] = False
    """For programs: a JSON list of objects."""

    def run(self) -> None:
        models = listing()
        if self.json:
            print(json.dumps(models, indent=2))
            return
        for model in models:
            origin = [
                f"{key} {_text(model[key])}" for key in ("preset", "steps", "seconds", "loss") if key in model
            ]
            print(f"{model['name']:16}  {model['method']}: {', '.join(model.get('maps', ['relief']))}")
            print(f"{'':16}  {', '.join(origin)}")
            if model["thumbnail"]:
                print(f"{'':16}  {model['thumbnail']}")
        for family, names in _families(models).items():
            print(f"family {family}, which can be grafted with each other: {', '.join(names)}")


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
