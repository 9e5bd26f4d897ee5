"""`mitex models`."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

THUMBNAILS = (".png", ".jpg")


@dataclass
class Models:
    """List the textures that ship with Mitex; use their names with `mitex apply`.

    examples:
      mitex models
      mitex models --json
    """

    as_json: Annotated[bool, arg(name="json", help_behavior_hint="")] = field(default=False)
    """For programs: a JSON list of objects."""

    def run(self) -> None:
        models = listing()
        if self.as_json:
            print(json.dumps(models, indent=2))
            return
        for model in models:
            made = [f"{key} {model[key]}" for key in ("preset", "steps", "seconds", "loss") if key in model]
            print(f"{model['name']:16}  {', '.join(model['maps'])}")
            print(f"{'':16}  {', '.join(made)}")
            if model["thumbnail"]:
                print(f"{'':16}  {model['thumbnail']}")


def listing() -> list[dict[str, Any]]:
    """What is known about every bundled model: name, path, thumbnail or None, maps, how it was made."""
    from mitex.methods.nca import files

    models = []
    for name, path in files.bundled().items():
        about = files.load(path)[1]
        models.append({**about, "name": name, "path": str(path), "thumbnail": _thumbnail(path)})
    return models


def _thumbnail(path: Path) -> str | None:
    found = [path.with_suffix(suffix) for suffix in THUMBNAILS if path.with_suffix(suffix).is_file()]
    return str(found[0]) if found else None
