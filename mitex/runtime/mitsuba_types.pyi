"""Mitsuba as type checkers see it: of a variant in which `mi.Float` and its like are Dr.Jit's own types.

Vectors, rays and interactions are made of those; Mitsuba's stubs export types apart, which fit none of them.
"""

from typing import Any

import drjit.auto.ad
from mitsuba import *  # noqa: F403
from mitsuba import Integrator, Scene, Sensor

# isort: split
from drjit.auto.ad import Bool as Bool
from drjit.auto.ad import Float as Float
from drjit.auto.ad import Float64 as Float64
from drjit.auto.ad import Int32 as Int32
from drjit.auto.ad import Matrix3f as Matrix3f
from drjit.auto.ad import TensorXf as TensorXf
from drjit.auto.ad import UInt8 as UInt8
from drjit.auto.ad import UInt32 as UInt32

def _render(
    scene: Scene,
    params: Any = None,
    sensor: int | Sensor = 0,
    integrator: Integrator | None = None,
    seed: int | drjit.auto.ad.UInt32 = 0,
    seed_grad: int | drjit.auto.ad.UInt32 = 0,
    spp: int = 0,
    spp_grad: int = 0,
) -> TensorXf: ...

render = _render  # the stubs take no number as a seed

def __getattr__(name: str) -> Any: ...  # what the stubs leave out: `is_spectral`, `ArrayXf`, ...
