"""Options of `mitex apply` reach the texture."""

from pathlib import Path

import pytest

from mitex.methods import registry
from mitex.methods.baselines.displacement.cli import Apply as Displacement
from mitex.methods.baselines.gatys.cli import Apply as Gatys
from mitex.methods.baselines.nerf_tex.cli import Apply as NerfTex
from mitex.methods.baselines.plain_field.cli import Apply as PlainField
from mitex.methods.baselines.quilted.cli import Apply as Quilted
from mitex.methods.baselines.reaction_diffusion.cli import Apply as ReactionDiffusion
from mitex.methods.baselines.solid_texture.cli import Apply as SolidTexture

BASELINES = "mitex.methods.baselines"
SHARED = {"scale": 2.0, "resolution": 64, "keep_uvs": True}


class Recorder:
    """Stands in for a texture, and gives back what it is told."""

    def apply(self, mesh=None, **options):
        return mesh and mesh.name, options


@pytest.mark.parametrize(
    ("method", "own"),
    [(Gatys, {}), (SolidTexture, {"seed": 7}), (ReactionDiffusion, {"seed": 7, "steps": 9})],
    ids=["gatys", "solid_texture", "reaction_diffusion"],
)
def test_options_reach_the_texture(method, own, monkeypatch):
    monkeypatch.setattr(registry, "load", lambda source: {"run": Recorder()}[source])
    options = method(model="run", mesh="vase", out="vase.glb", **SHARED, **own)
    assert options.applied(Path("vase.glb")) == ("vase", SHARED | own)


BOXES = {"scale": 2.0, "spacing": 0.7, "tilt": 9.0, "aligned": True}
BOXES |= {"lift": 0.4, "density": 3.0, "seed": 7}


@pytest.mark.parametrize(
    ("method", "texture", "own"),
    [
        (NerfTex, "nerf_tex.NerfTexTexture", BOXES),
        (Displacement, "displacement.DisplacementMap", {"scale": 2.0, "subdivide": 3}),
        (Quilted, "quilted.QuiltedTexture", {"scale": 2.0, "resolution": 64}),
    ],
    ids=["nerf_tex", "displacement", "quilted"],
)
def test_all_options_reach_a_texture_of_its_own(method, texture, own, monkeypatch):
    monkeypatch.setattr(f"{BASELINES}.{texture}.load", lambda source: {"run": Recorder()}[source])
    options = method(model="run", mesh="vase", out="vase.glb", **own)
    assert options.applied(Path("vase.glb")) == ("vase", own)


def test_the_density_of_a_plain_field(monkeypatch):
    monkeypatch.setattr(
        f"{BASELINES}.plain_field.PlainFieldTexture.load", lambda source: {"run": Recorder()}[source]
    )
    options = PlainField(model="run", out="a.glb", density=3.0)
    assert options.applied(Path("a.glb")) == (None, {"density": 3.0})
