"""The document: what is in it, what it may do, and names that try to be markup."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from mitex.errors import MeshError, OutputError
from mitex.mesh import Mesh, torus
from mitex.page import Content, document, mesh_data, packed, quantised
from tests.page.unpacking import unpacked

HOSTILE = '</script><script>window.attacked = true</script><img src=x onerror="window.attacked = true">\u2028'


def test_arrays_come_back(rng):
    for kind in ("float32", "float64", "uint8", "uint16", "uint32", "int32"):
        values = rng.normal(0, 100, (7, 3)).astype(kind)
        assert np.array_equal(unpacked(packed(values)), values.ravel())


def test_other_arrays_are_refused():
    with pytest.raises(TypeError, match="int64"):
        packed(np.arange(3))


def test_a_mesh_keeps_its_shape_to_half_a_step():
    mesh = torus(16, 8)
    shown = quantised(mesh)
    assert np.abs(shown.vertices - mesh.vertices).max() <= 0.51 * np.ptp(mesh.vertices, axis=0).max() / 65535
    assert np.array_equal(quantised(shown).vertices, shown.vertices)
    data = mesh_data(mesh, 0)
    faces = np.cumsum(unpacked(data["faces"]).reshape(-1, 3), axis=0, dtype=np.uint16)
    assert np.array_equal(faces, mesh.faces)


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(MeshError, match="no faces"):
        mesh_data(Mesh(np.zeros((3, 3)), np.empty((0, 3), int)), 0)


def test_names_stay_text():
    text = document(HOSTILE, {"name": HOSTILE}, b"")
    tags = Tags()
    tags.feed(text)
    assert tags.names.count("script") == 2 and tags.names.count("img") == 0
    assert tags.texts["title"] == HOSTILE
    assert json.loads(tags.texts["script"])["name"] == HOSTILE


def test_nothing_may_be_fetched_and_no_other_script_run():
    text = document("a", {}, b"")
    (policy,) = re.findall(r'Content-Security-Policy" content="(.*?)"', text)
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe" not in policy and "http" not in policy
    assert not re.search(r"<link|@import|src=\"(?!data:)", text)


def test_a_place_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        Content("a", {}).write(tmp_path / "file" / "a.html")


class Tags(HTMLParser):
    """The names of the tags that a document opens, and the first text in each kind."""

    def __init__(self) -> None:
        super().__init__()
        self.names, self.texts = [""], {}

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)

    def handle_data(self, data):
        self.texts.setdefault(self.names[-1], data)
