"""Options of `mitex apply` reach the texture."""

from pathlib import Path

import pytest

from mitex.methods import registry
from mitex.methods.baselines.gatys.cli import Apply as Gatys
from mitex.methods.baselines.reaction_diffusion.cli import Apply as ReactionDiffusion
from mitex.methods.baselines.solid_texture.cli import Apply as SolidTexture

SHARED = {"scale": 2.0, "resolution": 64, "keep_uvs": True}


class Recorder:
    """Stands in for a texture, and gives back what it is told."""

    def apply(self, mesh, **options):
        return mesh.name, options


@pytest.mark.parametrize(
    ("method", "own"),
    [(Gatys, {}), (SolidTexture, {"seed": 7}), (ReactionDiffusion, {"seed": 7, "steps": 9})],
    ids=["gatys", "solid_texture", "reaction_diffusion"],
)
def test_options_reach_the_texture(method, own, monkeypatch):
    monkeypatch.setattr(registry, "load", lambda source: {"run": Recorder()}[source])
    options = method(model="run", mesh="vase", out="vase.glb", **SHARED, **own)
    assert options.applied(Path("vase.glb")) == ("vase", SHARED | own)
