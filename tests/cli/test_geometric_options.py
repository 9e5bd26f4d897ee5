"""What `mitex apply` and `mitex animate` of geometric textures hand on, and the ranges of their options."""

import pytest

from mitex.mesh import Mesh
from tests.cli.handing_on import handed_on
from tests.cli.refusals import check_refused

TEXTURE = "mitex.methods.geometric.GeometricTexture"


@pytest.mark.parametrize(
    ("words", "given"),
    [
        ("", (0, 0, None)),
        ("--seed 7", (7, 0, None)),
        ("--start-level 1 --end-level 3 --seed 2", (2, 1, 3)),
    ],
)
def test_a_variation_of_the_reference(files, monkeypatch, words, given):
    words = f"apply spikes --mesh template --out out/a.ply {words}"
    arguments, options = handed_on(monkeypatch, f"{TEXTURE}.generate", words.split())
    assert arguments[1:] == given and options == {}


GROWTH = "--seed 4 --start-level 1 --end-level 3 --placement none"
GIVEN = {"start_level": 1, "end_level": 3, "placement": "none"}


def test_a_relief_on_a_mesh(files, monkeypatch):
    words = f"apply spikes --mesh good.obj --out out/a.ply --untangle {GROWTH}"
    (_, mesh), options = handed_on(monkeypatch, f"{TEXTURE}.apply", words.split())
    assert mesh.name == "good" and options == {"seed": 4, "untangle": True, "field": None, **GIVEN}


@pytest.mark.parametrize("mesh", ["good.obj", "template"])
@pytest.mark.parametrize(
    ("words", "method", "given"),
    [("", "growth", ((9,), {"seed": 4})), ("--to-seed 6", "interpolate", (((4, 6), 9), {}))],
)
def test_frames(files, monkeypatch, mesh, words, method, given):
    placement = "even" if mesh == "template" else "none"  # lower levels place the template's
    growth = GROWTH.replace("none", placement)
    words = f"animate spikes --mesh {mesh} --out out/a.gif --frames 9 {growth} {words}"
    (texture, shown, *more), options = handed_on(monkeypatch, f"{TEXTURE}.{method}", words.split())
    assert (shown is texture.template) == (mesh == "template")
    assert tuple(more) == given[0] and options == {**given[1], "field": None, **GIVEN, "placement": placement}


def test_frames_from_the_template_begin_with_its_own_level(files, monkeypatch):
    """On a mesh, the texture says which level is the first."""
    for mesh, start in (("template", 0), ("good.obj", None)):
        words = f"animate spikes --mesh {mesh} --out out/a.gif"
        _, options = handed_on(monkeypatch, f"{TEXTURE}.growth", words.split())
        assert options["start_level"] == start and options["end_level"] is None


@pytest.mark.parametrize(
    ("words", "given"),
    [
        ("", {"resolution": 384, "spp": 32, "fps": 24}),
        ("--resolution 16 --spp 3 --fps 7", {"resolution": 16, "spp": 3, "fps": 7}),
    ],
)
def test_pictures_of_a_film(files, monkeypatch, words, given):
    mesh = Mesh.load("good.obj")
    monkeypatch.setattr(
        f"{TEXTURE}.growth", lambda *_, **__: iter([mesh, mesh.with_vertices(2 * mesh.vertices)])
    )
    words = f"animate spikes --mesh good.obj --out out/a.mp4 --frames 2 {words}"
    (frames, out), options = handed_on(monkeypatch, "mitex.render.film", words.split())
    assert len(list(frames)) == 2 and out == files / "out" / "a.mp4"
    like = options.pop("like")
    assert like.vertices.max() == 2 and options == {"frames": 2, **given}


OUT_OF_RANGE = [
    *("--seed -1", "--to-seed -1", "--to-seed 4294967296", "--frames 3601"),
    *("--resolution 15", "--resolution 4097", "--spp 0", "--spp 65537", "--fps 61"),
    *("--start-level -1", "--start-level 7", "--end-level -1", "--end-level 7"),
    *("--remesh 11", "--remesh 2000001"),
]


@pytest.mark.parametrize("words", OUT_OF_RANGE)
def test_films_out_of_range(files, words, capsys):
    film = f"animate spikes --mesh good.obj --out out/a.gif {words}".split()
    check_refused(files, film, f"{words} is out of range", capsys)


def test_films_of_a_template_follow_no_field(files, capsys):
    words = ["animate", "spikes", "--mesh", "template", "--out", "out/a.gif", "--field", "up"]
    check_refused(files, words, "--mesh template and --field contradict each other", capsys)
