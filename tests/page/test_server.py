"""The server of `mitex view`: this machine alone, and only those who know the token."""

import json
from http.client import HTTPConnection
from threading import Thread

import pytest

from mitex.page.server import PageServer


@pytest.fixture
def server():
    with PageServer(lambda: "<p>page</p>", lambda: {"loss": [[1, 0.5]]}) as server:
        thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def ask(server, path, host=None):
    """Status and body of a request to the server, which names a host."""
    connection = HTTPConnection(*server.server_address[:2])
    connection.putrequest("GET", path, skip_host=True)
    connection.putheader("Host", host or server.host)
    connection.endheaders()
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


def test_the_page_and_its_news_are_served(server):
    assert server.url == f"http://{server.host}/{server.token}/" and server.server_address[0] == "127.0.0.1"
    assert ask(server, f"/{server.token}/") == (200, "<p>page</p>")
    status, body = ask(server, f"/{server.token}/news")
    assert status == 200 and json.loads(body) == {"loss": [[1, 0.5]]}


@pytest.mark.parametrize("path", ["/", "/news", "/wrong/", "/{token}/../etc/passwd", "/{token}/other"])
def test_nothing_else_is(server, path):
    assert ask(server, path.format(token=server.token))[0] == 404


def test_pages_under_other_names_get_nothing(server):
    assert ask(server, f"/{server.token}/", host="example.org")[0] == 404
