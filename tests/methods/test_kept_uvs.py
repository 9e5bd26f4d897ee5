"""`--keep-uvs` of methods whose textures belong to a mesh: the layout is the mesh's own, or a new one."""

import numpy as np
import pytest

from mitex.asset import clay
from mitex.cli import main
from mitex.mesh import Mesh
from tests.methods.surface.grids import flat_square

FITTINGS = {
    "multi_view_gram": ("--exemplar lava", "baselines.multi_view_gram.fitting.MultiViewTask"),
    "style_mesh": ("--exemplar lava", "baselines.style_mesh.fitting.StyleMeshTask"),
    "text2mesh": ("--exemplar lava", "baselines.text2mesh.fitting.Text2MeshTask"),
    "x_mesh": ("--text red --clip words", "baselines.x_mesh.fitting.XMeshTask"),
    "surface": ("--exemplar lava", "surface.fitting.SurfaceTask"),
}


class Reached(Exception):
    """Work would begin now."""


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize("method", FITTINGS)
def test_the_layout_is_kept_if_that_is_asked_for(method, kept, tmp_path, monkeypatch):
    """A quarter of the square that the mesh has for itself; a new layout uses most of it."""
    square = flat_square(4)
    assert square.uv is not None
    clay(Mesh(square.vertices, square.faces, uv=0.5 * square.uv)).export(tmp_path / "square.obj")
    source, place = FITTINGS[method]
    layouts = []

    def task(*arguments, **_):
        mesh = next(one for one in map(lambda x: getattr(x, "mesh", x), arguments) if isinstance(one, Mesh))
        layouts.append(np.ptp(np.asarray(mesh.uv).reshape(-1, 2), axis=0).max())
        raise Reached

    module, _, name = place.rpartition(".")
    monkeypatch.setattr(f"mitex.methods.{module}.{name}", task)
    monkeypatch.chdir(tmp_path)
    words = f"fit {method} {source} --mesh square.obj --out run --quiet --set resolution=64"
    with pytest.raises(Reached):
        main([*words.split(), *(["--keep-uvs"] if kept else [])])
    assert (layouts[0] < 0.55) == kept
