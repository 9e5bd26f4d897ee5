"""Pages in Firefox without a window, driven by its own protocol (Marionette: JSON over a socket)."""

import json
import os
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from subprocess import DEVNULL
from typing import Any

import pytest

from tests.browser import Tab

PREFERENCES = {"marionette.port": 0, "webgl.force-enabled": True}
PATIENCE = 600  # [s]


class Firefox:
    """A Firefox that is started on first use; without one, or its WebGL2, a test says that it skips."""

    def __init__(self) -> None:
        self._processes: list[subprocess.Popen] = []
        self._profile: tempfile.TemporaryDirectory | None = None
        self._socket: socket.socket | None = None

    def open(self, page: Path, side: int = 128) -> "FirefoxTab":
        """A page that stands still, with a square picture of `side` pixels."""
        if self._socket is None:
            self._start()
        self.command("WebDriver:Navigate", url=f"{page.as_uri()}#still={side}")
        tab = FirefoxTab(self)
        if not self.script("return !!document.createElement('canvas').getContext('webgl2')"):
            pytest.skip("Firefox has no WebGL2 here")
        return tab

    def script(self, text: str, argument: Any = None) -> Any:
        """What a script returns, or promises."""
        return self.command("WebDriver:ExecuteScript", script=text, args=[argument], sandbox=None)["value"]

    def command(self, name: str, **values: Any) -> Any:
        """The answer to a command."""
        assert self._socket is not None
        message = json.dumps([0, 1, name, values]).encode()
        self._socket.sendall(b"%d:%s" % (len(message), message))
        _, _, error, result = self._answer()
        assert error is None, error
        return result

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        for process in reversed(self._processes):
            process.terminate()
            process.wait()
        if self._profile is not None:
            self._profile.cleanup()

    def _start(self) -> None:
        program = shutil.which("firefox-esr") or shutil.which("firefox")
        if program is None:
            pytest.skip("no Firefox: there is nothing to open a page with")
        self._profile = tempfile.TemporaryDirectory()
        folder = Path(self._profile.name)
        rows = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in PREFERENCES.items()]
        (folder / "user.js").write_text("\n".join(rows))
        command = [program, "--headless", "--marionette", "--no-remote", "--profile", str(folder)]
        environment = os.environ | {"DISPLAY": os.environ.get("DISPLAY") or self._display()}
        self._processes.append(subprocess.Popen(command, env=environment, stdout=DEVNULL, stderr=DEVNULL))
        port, started = folder / "MarionetteActivePort", time.monotonic()
        while not (port.exists() and port.read_text().strip()):
            if self._processes[-1].poll() is not None or time.monotonic() > started + PATIENCE:
                pytest.skip("Firefox does not start here")
            time.sleep(0.1)
        self._socket = socket.create_connection(("127.0.0.1", int(port.read_text())), PATIENCE)
        self._answer()  # its greeting
        self.command("WebDriver:NewSession", capabilities={})
        self.command("WebDriver:SetTimeouts", script=1000 * PATIENCE, pageLoad=1000 * PATIENCE)

    def _display(self) -> str:
        """Of an X server of its own: even without a window, Firefox asks one for WebGL."""
        program = shutil.which("Xvfb")
        if program is None:
            return ""
        read, write = os.pipe()
        command = [program, "-displayfd", str(write), "-screen", "0", "640x480x24"]
        self._processes.append(subprocess.Popen(command, pass_fds=[write], stderr=DEVNULL))
        os.close(write)
        with os.fdopen(read) as numbers:
            return f":{numbers.readline().strip()}"

    def _answer(self) -> Any:
        assert self._socket is not None
        length = b""
        while (character := self._socket.recv(1)) != b":":
            length += character
        body = b""
        while len(body) < int(length):
            body += self._socket.recv(int(length) - len(body))
        return json.loads(body)


class FirefoxTab(Tab):
    """As `Tab`, but what goes wrong in the page is not seen."""

    def __init__(self, firefox: Firefox) -> None:
        self.firefox, self.errors = firefox, []

    def run(self, script: str, argument: Any = None) -> Any:
        text = f"return (async (argument) => {{ const page = await window.mitex; {script} }})(arguments[0])"
        return self.firefox.script(text, argument)
