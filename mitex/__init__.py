"""Mitex: texture synthesis on meshes, on Mitsuba 3 and PyTorch.

Names are resolved on first use, so that `import mitex` stays quick and loads neither torch nor Mitsuba.
"""

from typing import TYPE_CHECKING

from mitex.lazy import attributes

__version__ = "0.1.0"

__all__ = [
    "Asset",
    "Cancelled",
    "CaptureError",
    "CaptureWarning",
    "CheckpointError",
    "ConfigError",
    "Exemplar",
    "ImageError",
    "Interrupted",
    "Mesh",
    "MeshError",
    "MeshWarning",
    "MissingPackage",
    "MitexError",
    "MitexWarning",
    "OutputError",
    "Progress",
    "RuntimeUnavailable",
    "TextureWarning",
    "TrainingDiverged",
    "WeightsError",
    "__version__",
    "init",
    "load",
    "methods",
]

_ERRORS = (
    *("CaptureError", "CheckpointError", "ConfigError", "ImageError", "MeshError", "MissingPackage"),
    *("MitexError", "OutputError", "RuntimeUnavailable", "WeightsError"),
    *("CaptureWarning", "MeshWarning", "MitexWarning", "TextureWarning"),
)

__getattr__ = attributes(
    __name__,
    {
        **dict.fromkeys(_ERRORS, "mitex.errors"),
        **dict.fromkeys(("Cancelled", "Interrupted", "TrainingDiverged"), "mitex.training.errors"),
        "Asset": "mitex.asset",
        "Exemplar": "mitex.exemplar",
        "Mesh": "mitex.mesh",
        "Progress": "mitex.training.control",
        "init": "mitex.plugins",
        "load": "mitex.methods.registry",
        "methods": "",
    },
)

if TYPE_CHECKING:
    from mitex import methods
    from mitex.asset import Asset
    from mitex.errors import (
        CaptureError,
        CaptureWarning,
        CheckpointError,
        ConfigError,
        ImageError,
        MeshError,
        MeshWarning,
        MissingPackage,
        MitexError,
        MitexWarning,
        OutputError,
        RuntimeUnavailable,
        TextureWarning,
        WeightsError,
    )
    from mitex.exemplar import Exemplar
    from mitex.mesh import Mesh
    from mitex.methods.registry import load
    from mitex.plugins import init
    from mitex.training.control import Progress
    from mitex.training.errors import Cancelled, Interrupted, TrainingDiverged


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
