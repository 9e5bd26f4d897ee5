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
            print(f"{model['name']:16}  {model['method']}: {', '.join(model.get('maps', ['relief']))}")
            print(f"{'':16}  {', '.join(made)}")
            if model["thumbnail"]:
                print(f"{'':16}  {model['thumbnail']}")


def listing() -> list[dict[str, Any]]:
    """What is known about every bundled model: name, method, path, thumbnail or None, how it was made.

    Those of nca have their maps there too.
    """
    from mitex.methods.geometric import GeometricTexture
    from mitex.methods.kind import bundled
    from mitex.methods.nca import NcaTexture

    models = []
    for method, texture in (("nca", NcaTexture), ("geometric", GeometricTexture)):
        for name, path in bundled(method).items():
            known = {**texture.load(path).about, "name": name, "method": method}
            models.append({**known, "path": str(path), "thumbnail": _thumbnail(path)})
    return models


def _thumbnail(path: Path) -> str | None:
    found = [path.with_suffix(suffix) for suffix in THUMBNAILS if path.with_suffix(suffix).is_file()]
    return str(found[0]) if found else None
