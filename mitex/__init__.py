"""Mitex: texture synthesis on meshes, on Mitsuba 3 and PyTorch.

Names are resolved on first use, so that `import mitex` stays quick and loads neither torch nor Mitsuba.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

__all__ = ["Asset", "Exemplar", "Mesh", "__version__", "init", "load", "methods"]

_HOMES = {
    "Asset": ("mitex.asset", "Asset"),
    "Exemplar": ("mitex.exemplar", "Exemplar"),
    "Mesh": ("mitex.mesh", "Mesh"),
    "init": ("mitex.plugins", "init"),
    "load": ("mitex.methods.registry", "load"),
    "methods": ("mitex.methods", None),
}

if TYPE_CHECKING:
    from mitex import methods
    from mitex.asset import Asset
    from mitex.exemplar import Exemplar
    from mitex.mesh import Mesh
    from mitex.methods.registry import load
    from mitex.plugins import init


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mitex' has no attribute {name!r}")
    module, attribute = _HOMES[name]
    loaded = import_module(module)
    value = loaded if attribute is None else getattr(loaded, attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
