"""A synthesis does not show where its charts end."""

import pytest

from mitex.evaluation.seams import seam_ratio
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods import surface


@pytest.mark.usefixtures("own_cache")
def test_a_synthesis_has_no_seams(tmp_path):
    """At most a tenth more across seams than elsewhere."""
    exemplar = Exemplar({"albedo": Exemplar.load("cobblestone").maps["albedo"]})
    settings = ["resolution=128", "exemplar_size=64", "steps=60", "milestones=40,50", "preview_every=0"]
    texture = surface.fit(exemplar, icosphere(12), tmp_path / "run", set=settings)
    assert seam_ratio(texture.apply(), texture.domain.texels.size) < 1.1
