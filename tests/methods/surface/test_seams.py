"""A synthesis does not show where its charts end."""

import pytest

from mitex.evaluation.seams import seam_ratio
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods import surface


@pytest.mark.usefixtures("own_cache")
def test_a_synthesis_has_no_seams(tmp_path):
    """No more across seams than elsewhere; with texels of their own beyond the charts it would be as much."""
    exemplar = Exemplar({"albedo": Exemplar.load("cobblestone").maps["albedo"]})
    settings = ["resolution=128", "exemplar_size=64", "steps=30", "milestones=20,25", "preview_every=0"]
    layers = "layers=relu1_1,pool1,relu2_1,pool2,relu3_1"
    texture = surface.fit(exemplar, icosphere(12), tmp_path / "run", set=[*settings, layers])
    assert seam_ratio(texture.apply(), texture.domain.texels.size) < 0.95
