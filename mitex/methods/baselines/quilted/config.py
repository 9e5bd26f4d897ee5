"""Settings of the quilted pictures."""

from __future__ import annotations

from dataclasses import dataclass

from mitex.training.settings import FitConfig, key


@dataclass(frozen=True)
class QuiltedConfig(FitConfig):
    """Settings of a quilted picture; every key can be set from a TOML file or with `--set`."""

    size: int = key(1024, "side of the picture [texels]", 128, 8192)
    patches: int = key(2000, "patches taken from the base shape, at most", 1)
    even: bool = key(True, "patches that were used before are avoided, as in the texture; published: not")
    relit: bool = key(True, "the light of the capture is taken off the pictures of patches")


DEFAULT = QuiltedConfig()
PRESETS = {DEFAULT.preset: DEFAULT}
