"""Every plugin of Mitex, with properties of which it reads all, in the variant of the moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mitex.integrators import FeatureIntegrator, LitShellIntegrator, MotionIntegrator, ShellIntegrator
from mitex.mesh import Similarity, icosphere
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload
from mitex.textures import DecodedField, TexelField, VertexField
from mitex.textures.shell_field import shell_field

BALL = icosphere(1)


@dataclass(frozen=True)
class Plugin:
    """A class, the base of Mitsuba that makes it a plugin, and its entries of a scene's dictionary."""

    cls: type
    base: str
    properties: Callable[[], dict[str, Any]]


class Fog:
    """A radiance field with one parameter."""

    step, mask = 0.1, None

    def __init__(self) -> None:
        self.density = mi.Float(1)

    def parameters(self) -> dict[str, Any]:
        return {"density": self.density}

    def parameters_changed(self) -> None: ...

    def evaluate(self, points: Any, view: Any) -> Any: ...

    def extinction(self, points: Any) -> Any: ...

    def reflection(self, points: Any, view: Any) -> Any: ...


def fog() -> Any:
    """A `shell_field`."""
    field: Any = Fog()
    return shell_field(field, Similarity(np.zeros(3), 1.0))


def _tensor(*shape: int) -> mi.TensorXf:
    return upload(mi.TensorXf, np.full(shape, 0.5, np.float32))


def _decoded() -> dict[str, Any]:
    mesh = {name: np.asarray(getattr(BALL, name), np.float32) for name in ("vertices", "faces")}
    layer = {"weight_0": _tensor(4, 5), "bias_0": _tensor(4)}
    waves = {"coordinates": "waves", "waves": _tensor(2, 4)}
    return (
        {"data": _tensor(12, 3)} | {name: upload(mi.TensorXf, v) for name, v in mesh.items()} | layer | waves
    )


PLUGINS = {
    "vertex_field": Plugin(VertexField, "Texture", lambda: {"data": _tensor(12, 3)}),
    "texel_field": Plugin(
        TexelField, "Texture", lambda: {"data": _tensor(2, 2, 3), "charts": 0 * _tensor(2, 2)}
    ),
    "decoded_field": Plugin(DecodedField, "Texture", _decoded),
    "feature": Plugin(
        FeatureIntegrator, "CppADIntegrator", lambda: {"field": mi.load_dict({"type": "checkerboard"})}
    ),
    "motion": Plugin(
        MotionIntegrator, "CppADIntegrator", lambda: {"field": mi.load_dict({"type": "checkerboard"})}
    ),
    "shell": Plugin(ShellIntegrator, "SamplingIntegrator", lambda: {"field": fog()}),
    "lit_shell": Plugin(LitShellIntegrator, "SamplingIntegrator", lambda: {"field": fog()}),
}
