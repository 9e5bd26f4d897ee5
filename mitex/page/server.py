"""Serving one page to the browser of this machine."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

LOCAL = "127.0.0.1"


class PageServer(ThreadingHTTPServer):
    """A server of a page and of what is new, on a port of its own that no other machine reaches.

    Its address holds a token that cannot be guessed: other programs and pages on this machine get nothing.

    Args:
        page: gives the document.
        news: gives what has changed since, as JSON values; it is asked every few seconds.
    """

    daemon_threads = True

    def __init__(self, page: Callable[[], str], news: Callable[[], Any]) -> None:
        self.token = secrets.token_urlsafe(16)
        self.answers = {"": (page, "text/html"), "news": (lambda: json.dumps(news()), "application/json")}
        super().__init__((LOCAL, 0), _Handler)

    @property
    def host(self) -> str:
        return f"{LOCAL}:{self.server_address[1]}"

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{self.host}/{self.token}/"


class _Handler(BaseHTTPRequestHandler):
    server: PageServer

    def do_GET(self) -> None:
        _, token, *rest = self.path.split("/")
        known = secrets.compare_digest(token.encode(), self.server.token.encode())
        # A page elsewhere that has its own name point to this machine sends that name.
        answer = (
            self.server.answers.get("/".join(rest)) if self.headers.get("Host") == self.server.host else None
        )
        if not known or answer is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        content, kind = answer
        body = content().encode()
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is the user's."""
