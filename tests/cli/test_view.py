"""`mitex view`: what it shows, where it says that it is, and who opens it."""

import webbrowser

import pytest

from mitex.asset import clay
from mitex.cli import main
from mitex.mesh import Mesh
from tests.cli.refusals import check_refused

URL = "http://127.0.0.1:1/token/"


class Server:
    """Stands in for the server of a page; Ctrl-C ends it at once."""

    url = URL

    def __init__(self, page, news):
        self.page, self.news = page, news

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def serve_forever(self):
        raise KeyboardInterrupt


@pytest.fixture
def opened(monkeypatch):
    """Addresses that a browser has opened."""
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    return opened


@pytest.fixture
def servers(opened, monkeypatch):
    """Servers of pages that were started; a page is its data."""
    servers = []
    monkeypatch.setattr(
        "mitex.page.server.PageServer", lambda *given: servers.append(Server(*given)) or servers[-1]
    )
    monkeypatch.setattr("mitex.page.Content.html", lambda content: content.data)
    return servers


def names(servers, key):
    return [shown["name"] for shown in servers[-1].page()[key]]


def test_the_address_is_printed_and_opened(files, servers, opened, capsys):
    assert main(["view", "pebbles", "--mesh", "good.obj"]) == 0
    assert capsys.readouterr().out == f"{URL}\n" and opened == [URL]
    assert main(["view", "pebbles", "--mesh", "good.obj", "--no-browser"]) == 0
    assert capsys.readouterr().out == f"{URL}\n" and opened == [URL]


@pytest.mark.parametrize(("words", "mesh"), [("", "vase"), ("--mesh good.obj", "good")])
def test_a_texture_on_a_mesh_and_a_sphere(files, servers, words, mesh):
    assert main(f"view lava {words}".split()) == 0
    assert names(servers, "meshes") == [mesh, "icosphere32"] and names(servers, "looks") == ["lava"]
    assert servers[-1].news() == {}


def test_an_asset(files, servers):
    clay(Mesh.load("good.obj")).export("a.ply")
    assert main(["view", "a.ply"]) == 0
    page = servers[-1].page()
    assert page["mesh"]["name"] == "a" and servers[-1].news() == {}


def test_what_does_not_grow_in_a_page(files, servers, opened, capsys):
    check_refused(files, ["view", "spikes"], "geometric textures do not grow in a page", capsys)
    check_refused(files, ["view", "pebbles", "--mesh", "none.obj"], "none.obj", capsys)
    assert not opened and not servers
