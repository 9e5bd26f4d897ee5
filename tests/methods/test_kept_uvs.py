"""`--keep-uvs` of methods whose textures belong to a mesh: the layout is the mesh's own, or a new one."""

import numpy as np
import pytest

from mitex.asset import clay
from mitex.cli import main
from mitex.mesh import Mesh
from tests.methods.surface.grids import flat_square

EXEMPLAR, WORDS = "--exemplar lava", "--text red --clip words"
FITTINGS = {
    "multi_view_gram": (EXEMPLAR, "baselines.multi_view_gram.fitting.MultiViewTask"),
    "style_mesh": (EXEMPLAR, "baselines.style_mesh.fitting.StyleMeshTask"),
    "text2mesh": (EXEMPLAR, "baselines.text2mesh.fitting.Text2MeshTask"),
    "text2mesh from words": (WORDS, "baselines.text2mesh.fitting.Text2MeshTextTask"),
    "x_mesh": (WORDS, "baselines.x_mesh.fitting.XMeshTask"),
    "surface": (EXEMPLAR, "surface.fitting.SurfaceTask"),
    "surface from words": (WORDS, "surface.fitting.SurfaceTask"),
}


class Reached(Exception):
    """Work would begin now."""


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize("name", FITTINGS)
def test_the_layout_is_kept_if_that_is_asked_for(name, kept, tmp_path, monkeypatch):
    """A quarter of the square that the mesh has for itself; a new layout uses most of it."""
    square = flat_square(4)
    assert square.uv is not None
    clay(Mesh(square.vertices, square.faces, uv=0.5 * square.uv)).baked(16).export(tmp_path / "square.obj")
    source, place = FITTINGS[name]
    layouts = []

    def task(*arguments, **_):
        mesh = next(one for one in map(lambda x: getattr(x, "mesh", x), arguments) if isinstance(one, Mesh))
        layouts.append(np.ptp(np.asarray(mesh.uv).reshape(-1, 2), axis=0).max())
        raise Reached

    monkeypatch.setattr(f"mitex.methods.{place}", task)
    monkeypatch.chdir(tmp_path)
    words = f"fit {name.split()[0]} {source} --mesh square.obj --out run --quiet --set resolution=64"
    with pytest.raises(Reached):
        main([*words.split(), *(["--keep-uvs"] if kept else [])])
    assert (layouts[0] < 0.55) == kept
