"""Pictures of radiance fields: what is refused before anything is rendered."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitex.errors import ConfigError, OutputError
from mitex.mesh import Similarity
from mitex.render import shell
from mitex.runtime import init
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload

SIMILARITY = Similarity(np.zeros(3), 1.0)
OUTLINE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)


class Nothing:
    """A field without matter."""

    def __init__(self) -> None:
        init()
        self.mask, self.step = upload(mi.TensorXu8, np.zeros((8, 8, 8), np.uint8)), 0.1

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        return mi.UInt32(), mi.Float(), mi.Color3f()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"resolution": 0}, "pixels is not possible"),
        ({"resolution": 10_000}, "pixels is not possible"),
        ({"elevation": -0.1}, "elevation"),
        ({"elevation": math.nan}, "elevation"),
        ({"spp": 0}, "samples per pixel"),
        ({"spp": 70_000}, "samples per pixel"),
        ({"light": "lamp"}, "a light called 'lamp'; use own or scene"),
        ({"light": "scene"}, "no reflection apart from its light"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(ConfigError, match=message):
        shell.shell_still(Nothing(), SIMILARITY, OUTLINE, **{"resolution": 16, "spp": 1} | options)


def test_a_camera_may_look_from_below_where_there_is_no_floor():
    picture = shell.shell_still(
        Nothing(), SIMILARITY, OUTLINE, resolution=16, spp=1, elevation=-30, floating=True
    )
    assert picture.shape == (16, 16, 3) and np.isfinite(picture).all()


def test_paths_and_exposures_are_checked_before_rendering(tmp_path, monkeypatch):
    monkeypatch.setattr(shell, "shell_still", lambda *_, **__: pytest.fail("rendered"))
    with pytest.raises(ConfigError, match="exposure"):
        shell.render_shell(Nothing(), SIMILARITY, OUTLINE, tmp_path / "a.png", exposure=99.0)
    with pytest.raises(OutputError):
        shell.render_shell(Nothing(), SIMILARITY, OUTLINE, tmp_path / "a.bmp")
    assert not list(tmp_path.iterdir())
