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
        "train for so long instead of `steps`, which a short training before finds out; the learning rate "
        "falls over all of it [s]; 0: for `steps`",
        0,
    )


SHARED = [one.name for one in fields(nerf.RadianceConfig)]
# Those of the texture that it is compared with: alike in rays, steps along them, and size of the tables.
PRESETS = {
    name: PlainFieldConfig(**{shared: getattr(preset, shared) for shared in SHARED})
    for name, preset in nerf.PRESETS.items()
}
