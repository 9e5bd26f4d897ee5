"""Which box is taken off a captured texture, and how it is pictured."""

import pytest

from mitex.methods.baselines.nerf_tex import fit
from tests.methods.nerf.small import small_texture

FITTING = "mitex.methods.baselines.nerf_tex.fitting"


class Reached(Exception):
    """Work would begin now."""


@pytest.mark.parametrize(
    ("settings", "piece", "pictures"),
    [([], (256, 0), (160, 128, 0)), (["patch=128", "views=20", "view=12", "seed=3"], (128, 3), (20, 12, 3))],
)
def test_settings_reach_the_box_and_its_pictures(monkeypatch, settings, piece, pictures):
    def take_box(texture, *given):
        assert texture is captured and given == piece
        return "box"

    def picture_box(box, *given):
        assert box == "box" and given == pictures
        raise Reached

    captured = small_texture()
    monkeypatch.setattr(f"{FITTING}.take_box", take_box)
    monkeypatch.setattr(f"{FITTING}.picture_box", picture_box)
    with pytest.raises(Reached):
        fit(captured, set=settings)
