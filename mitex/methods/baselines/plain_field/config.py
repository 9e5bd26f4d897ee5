"""Settings of the plain radiance field."""

from __future__ import annotations

from dataclasses import dataclass, fields

from mitex.methods.nerf import config as nerf
from mitex.training.settings import key


@dataclass(frozen=True)
class PlainFieldConfig(nerf.RadianceConfig):
    """Settings of a plain field; every key can be set from a TOML file or with `--set`."""

    seconds: float = key(
        0.0,
        "training time in place of `steps`: a short training beforehand tells how many steps it is enough "
        "for, and the learning rate falls over these [s]; 0: `steps` count",
        0,
    )


SHARED = [field.name for field in fields(nerf.RadianceConfig)]
# Those of the texture that it is compared with: alike in rays, steps along them, and size of the tables.
PRESETS = {
    name: PlainFieldConfig(**{key: getattr(preset, key) for key in SHARED})
    for name, preset in nerf.PRESETS.items()
}
