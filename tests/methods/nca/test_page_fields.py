"""Fields from files in the living page: those that it was written with, and those dropped onto it."""

import base64
import io

import numpy as np
import pytest
import torch
import trimesh

from mitex.mesh import Mesh, icosphere, subdivide_midpoint, torus
from mitex.methods.nca import NcaTexture, living_page
from mitex.methods.nca.motion.cell_motion import CellMotion
from mitex.methods.nca.motion.condition import cell_vectors, conditions
from mitex.methods.nca.orientation import cell_turns
from mitex.page import quantised
from tests.methods.nca import tiny
from tests.methods.nca.pages import after, shown, states

GIVEN = torus(12, 6)
ANGLE = 0.6  # by which the page is turned further [rad]


@pytest.fixture(scope="module")
def texture():
    look = tiny.texture(("albedo", "normal"), condition=3, shape=None).look
    return NcaTexture(look, {"name": "flow", "motion": "right"})


def smooth(seed, mesh=GIVEN):
    """A field that differs from vertex to vertex, and from `seed` to seed."""
    rng = np.random.default_rng(seed)
    return mesh.vertices @ rng.normal(0, 1, (3, 3)) + rng.normal(0, 0.3, (len(mesh.vertices), 3)) + 0.5


def npy(vectors):
    file = io.BytesIO()
    np.save(file, vectors)
    return file.getvalue()


def ply(mesh, vectors=None, names=("vx", "vy", "vz"), faces=True):
    """A PLY of text with vectors at the vertices, with or without its faces."""
    rows = mesh.vertices if vectors is None else np.hstack([mesh.vertices, vectors])
    columns = "xyz" if vectors is None else [*"xyz", *names]
    lines = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    lines += [f"property double {column}" for column in columns]
    lines += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices"] if faces else []
    lines += ["end_header", *(" ".join(map(repr, row.tolist())) for row in rows)]
    lines += [f"3 {a} {b} {c}" for a, b, c in mesh.faces] if faces else []
    return ("\n".join(lines) + "\n").encode()


def grown(texture, given, motion, upwards, angle=0.0, levels=1, speed=1.0):
    """The cells' mesh, their turns, and their states (V, C) after 16 steps."""
    base = quantised(given)
    mesh = subdivide_midpoint(base, levels)
    turns = cell_turns(upwards, mesh, base) + angle
    vectors = conditions(cell_vectors(base, mesh, motion, speed), mesh, turns)
    motion = CellMotion(torch.from_numpy(vectors))
    return mesh, turns, after(16, states(texture, mesh, turn=turns, motion=motion)).numpy()


@pytest.fixture(scope="module")
def path(texture, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    (folder / "motion.npy").write_bytes(npy(smooth(1)))
    (folder / "up.ply").write_bytes(ply(GIVEN, smooth(2)))
    files = {"field": folder / "motion.npy", "orientation": folder / "up.ply"}
    return living_page(texture, GIVEN, folder / "flow.html", steps=1, subdivide=1, speed=1.3, **files)


@pytest.mark.parametrize("way", ["webgl", "webgpu"])
def test_the_fields_of_files_are_followed(browser, path, texture, way):
    tab = browser.open(path, steps=way)
    mesh, turns, expected = grown(texture, GIVEN, smooth(1), smooth(2), speed=1.3)
    tab.run("await page.step(16)")
    ours = tab.array("page.automaton.read()").reshape(expected.shape)
    assert np.abs(ours - expected).max() < 1e-3 < 0.1 < np.abs(expected).max()
    plain = grown(texture, GIVEN, "right", 0.0)[2]
    assert np.abs(expected - plain).max() > 0.05
    if way == "webgl":
        _shows_the_turns(tab, texture, mesh, turns, torch.from_numpy(ours.copy()))
        _, _, further = grown(texture, GIVEN, smooth(1), smooth(2), ANGLE, speed=1.3)
        tab.run("page.orient(argument); page.reset(); await page.step(16)", ANGLE)
        assert np.abs(tab.array("page.automaton.read()").reshape(further.shape) - further).max() < 1e-3
        tab.run("page.setMesh(page.base, 0); await page.step(16)")
        _, _, coarse = grown(texture, GIVEN, smooth(1), smooth(2), ANGLE, levels=0, speed=1.3)
        assert np.abs(tab.array("page.automaton.read()").reshape(coarse.shape) - coarse).max() < 1e-3
    assert tab.errors == []


def _shows_the_turns(tab, texture, mesh, turns, state):
    """Normals at the pixels are turned with the cells around."""
    _, bent, _, _, ids = tab.maps()
    hit = ids[..., 0] > 0
    normals, straight = (shown(texture, state, mesh, turn, ids[hit])[1] for turn in (turns, 0.0))
    assert np.abs(bent[hit][:, :3] - normals).max() < 4e-3
    assert np.abs(normals - straight).max() > 0.1


DROP = """const [name, content, steps] = argument;
const status = document.getElementById("status");
const [base, { field, upwards }] = [page.base, page];
status.textContent = "";
const files = new DataTransfer();
files.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true }));
const fields = Object.values(base.fields);
const arrived = () => page.base !== base || Object.values(base.fields).some((one) => !fields.includes(one));
while (!status.textContent && !arrived()) await new Promise((done) => setTimeout(done, 10));
return [status.textContent, page.base.count, page.field, page.upwards]"""


def dropped(tab, name, content):
    return tab.run(DROP, [name, base64.b64encode(content).decode()])


def sixteen(tab):
    tab.run("page.reset(); await page.step(16)")
    return tab.array("page.automaton.read()")


def test_dropped_fields_are_followed(browser, texture, tmp_path):
    tab = browser.open(living_page(texture, GIVEN, tmp_path / "a.html", steps=1, subdivide=0))
    vectors = smooth(3)
    count = len(GIVEN.vertices)
    files = {
        "a.npy": npy(vectors),
        "b.npy": npy(np.asfortranarray(vectors.astype(">f4"))),
        "c.ply": ply(GIVEN, vectors),
        "d.ply": ply(GIVEN, vectors, ("fx", "fy", "fz"), faces=False),
    }
    expected = grown(texture, GIVEN, vectors, 0.0, levels=0)[2].ravel()
    for name, content in files.items():
        tab.run("page.move('up', 1)")
        assert dropped(tab, name, content) == ["", count, "motion", None]
        assert np.abs(sixteen(tab) - expected).max() < 1e-3, name
    # What is dropped on a texture that stays leads its up instead.
    tab.run("page.look.condition = 0")
    assert dropped(tab, "up.npy", npy(smooth(4))) == ["", count, "motion", "upwards"]
    tab.run("page.look.condition = 3; page.move('motion', 1)")
    expected = grown(texture, GIVEN, vectors, smooth(4), levels=0)[2].ravel()
    assert np.abs(sixteen(tab) - expected).max() < 1e-3
    tab.run("page.panel.build()")
    tab.page.get_by_role("button", name="Leave the field").click()
    assert np.abs(sixteen(tab) - grown(texture, GIVEN, vectors, 0.0, levels=0)[2].ravel()).max() < 1e-3
    # Another mesh has none of these fields, unless it brings its own.
    ball = icosphere(2)
    assert dropped(tab, "ball.ply", ply(ball)) == ["", 42, "right", None]
    assert dropped(tab, "led.ply", ply(icosphere(3), smooth(5, icosphere(3))))[1:3] == [92, "motion"]
    assert tab.picture().std() > 0.02 and tab.errors == []


def test_vectors_belong_to_the_vertices_of_the_file(browser, texture, tmp_path):
    """A box whose faces do not share vertices: 24 in the file, 8 places."""
    box = trimesh.creation.box()
    split = Mesh(box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3), name="box")
    tab = browser.open(living_page(texture, GIVEN, tmp_path / "a.html", steps=1, subdivide=0))
    assert dropped(tab, "box.ply", ply(split))[:2] == ["", 8]
    vectors = np.repeat(np.arange(36.0)[:, None], 3, 1) + [1, 2, 3]
    assert dropped(tab, "a.npy", npy(vectors))[:3] == ["", 8, "motion"]
    origin = np.array(tab.run("return page.base.origin"))
    assert np.array_equal(tab.array("page.base.fields.motion").reshape(-1, 3), vectors[origin])
    assert np.abs(split.vertices[origin] - tab.array("page.base.positions").reshape(-1, 3)).max() < 1e-6


NORMAL = icosphere(3)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    {
        "length": ("a.npy", npy(np.ones((5, 3))), "a.npy has 5 vectors, but the mesh has 92 vertices"),
        "nan": ("a.npy", npy(np.full((92, 3), np.nan)), "a.npy is NaN or infinite at vertex 0"),
        "normal": ("a.npy", npy(quantised(NORMAL).normals), "a.npy has no vector with a part along"),
        "shape": ("a.npy", npy(np.ones(92)), "its shape is (92), not (N, 3)"),
        "kind": ("a.npy", npy(np.full((92, 3), "x")), "it does not hold numbers"),
        "cut": ("a.npy", npy(np.ones((92, 3)))[:200], "a.npy is damaged"),
        "garbage": ("a.npy", b"no array at all", "this is no NumPy array"),
        "points": ("a.ply", ply(GIVEN, smooth(1), faces=False), "a.ply has 72 vectors"),
        "suffix": ("a.json", b"{}", "a.json is no OBJ, PLY, GLB or NPY file"),
    }.values(),
)
def test_what_cannot_be_followed_is_said(still, name, content, message):
    text, *rest = dropped(still, name, content)
    assert message in text and "\n" not in text
    assert rest == [92, "right", None] and still.errors == []


@pytest.fixture(scope="module")
def still(browser, texture, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "a.html"
    return browser.open(living_page(texture, NORMAL, path, steps=1, subdivide=0), 64)
