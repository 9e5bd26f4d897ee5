"""Values out of range of the options of `mitex apply`, which each method's command refuses by itself."""

import math

import pytest

from mitex.errors import ConfigError
from mitex.methods.baselines.displacement.cli import Apply as Displacement
from mitex.methods.baselines.gatys.cli import Apply as Gatys
from mitex.methods.baselines.nerf_tex.cli import Apply as NerfTex
from mitex.methods.baselines.plain_field.cli import Apply as PlainField
from mitex.methods.baselines.quilted.cli import Apply as Quilted
from mitex.methods.baselines.reaction_diffusion.cli import Apply as ReactionDiffusion
from mitex.methods.baselines.solid_texture.cli import Apply as SolidTexture
from mitex.methods.geometric.cli import Apply as Geometric
from mitex.methods.nerf.cli import Apply as Nerf

SCALE = [("scale", 0.04), ("scale", 20.1), ("scale", math.nan)]
SEED = [("seed", -1), ("seed", 2**32)]
TEXELS = [("resolution", 15), ("resolution", 8193)]
PIXELS = [("resolution", 63), ("resolution", 8193)]
DENSITY = [("density", 0.0), ("density", 1001.0), ("density", math.inf)]
LIFT = [("lift", -0.1), ("lift", 1.1)]
TABLE = {
    Gatys: SCALE + TEXELS,
    SolidTexture: SCALE + TEXELS + SEED,
    ReactionDiffusion: [*SCALE, *TEXELS, *SEED, ("steps", -1), ("steps", 10_001)],
    Displacement: [*SCALE, ("subdivide", -1), ("subdivide", 7)],
    Quilted: SCALE + TEXELS,
    NerfTex: [
        *(SCALE + SEED + PIXELS + DENSITY + LIFT),
        *(("spacing", 0.09), ("spacing", 2.1), ("tilt", -1.0), ("tilt", 46.0)),
    ],
    PlainField: PIXELS + DENSITY,
    Nerf: [*(SCALE + SEED + PIXELS + DENSITY + LIFT), ("size", 127), ("size", 8193)],
    Geometric: [
        *SEED,
        *(("start_level", -1), ("start_level", 7), ("end_level", -1), ("end_level", 7)),
        *(("remesh", 11), ("remesh", 2_000_001)),
    ],
}
CASES = {
    f"{method.__module__.split('.')[-2]}: {option} {value}": (method, option, value)
    for method, bad in TABLE.items()
    for option, value in bad
}


def options_of(method, **options):
    mesh = {} if method is PlainField else {"mesh": "vase"}
    return method(model="run", out="vase.glb", **mesh, **options)


@pytest.mark.parametrize("method", TABLE, ids=lambda method: method.__module__.split(".")[-2])
def test_the_defaults_are_in_range(method):
    options_of(method).check()


@pytest.mark.parametrize("name", CASES)
def test_a_value_out_of_range(name):
    method, option, value = CASES[name]
    with pytest.raises(ConfigError, match=f"--{option.replace('_', '-')} .* is out of range"):
        options_of(method, **{option: value}).check()
