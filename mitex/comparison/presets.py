"""The papers' comparisons as plans, on exemplars and meshes that are free."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path

from mitex.batch import Plan
from mitex.errors import ConfigError
from mitex.suggestions import suggestion

SUFFIX = ".toml"


def presets() -> list[str]:
    """Names of the papers' comparisons."""
    folder = files("mitex.comparison").joinpath("presets")
    return sorted(file.name.removesuffix(SUFFIX) for file in folder.iterdir() if file.name.endswith(SUFFIX))


def preset_plan(name: str, data: str | Path) -> Plan:
    """The plan of a paper's comparison.

    Args:
        name: of the comparison, such as "nca-fig10".
        data: folder with the exemplars and meshes that do not ship with Mitex.

    Raises:
        ConfigError: There is no such comparison.
    """
    if name not in presets():
        raise ConfigError(f"there is no comparison '{name}'", suggestion(name, presets()))
    text = files("mitex.comparison").joinpath("presets", name + SUFFIX).read_text(encoding="utf-8")
    return Plan.of(tomllib.loads(text), data)
