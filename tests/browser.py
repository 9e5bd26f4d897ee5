"""Pages in a real browser: Debian's Chromium without a window, which draws on the processor."""

import base64
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

FLAGS = [
    *("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader-webgl"),
    *("--enable-unsafe-swiftshader", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"),
    *("--enable-features=Vulkan,WebGPU", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
]
BYTES = """
const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
let text = "";
for (let k = 0; k < bytes.length; k += 8192) text += String.fromCharCode(...bytes.subarray(k, k + 8192));
return [values.constructor.name.replace("Array", "").toLowerCase().replace("clamped", ""), btoa(text)];
"""


class Browser:
    """A Chromium that is started on first use; without one, a test says that it skips.

    MITEX_REQUIRE_BROWSER makes its absence a failure.
    """

    def __init__(self) -> None:
        self._chromium = self._driver = None

    def open(self, page: Path | str, side: int = 128, steps: str = "webgl", before: str = "") -> "Tab":
        """A page, by its file or address, which stands still, with a square picture of `side` pixels.

        Its steps are taken by webgl, webgpu or, with auto, what the page itself takes; the script
        `before` runs first.
        """
        if self._chromium is None:
            self._start()
        assert self._chromium is not None
        address = page.as_uri() if isinstance(page, Path) else page
        tab = self._chromium.new_page(viewport={"width": 640, "height": 480})
        tab.add_init_script(before)
        return Tab(tab, f"{address}#still={side}&steps={steps}")

    def close(self) -> None:
        if self._chromium is not None and self._driver is not None:
            self._chromium.close()
            self._driver.stop()

    def _start(self) -> None:
        program = shutil.which("chromium") or shutil.which("chromium-browser")
        if program is None:
            if os.environ.get("MITEX_REQUIRE_BROWSER"):
                pytest.fail("no Chromium")
            pytest.skip("no Chromium: there is nothing to open a page with")
        from playwright.sync_api import sync_playwright

        self._driver = sync_playwright().start()
        self._chromium = self._driver.chromium.launch(executable_path=program, args=FLAGS)


class Tab:
    """A page that is open, as `page` of its scripts; what goes wrong in it is in `errors`."""

    def __init__(self, page: Any, address: str) -> None:
        self.page, self.errors, self.requests = page, [], []
        page.set_default_timeout(120_000)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.goto(address)

    def run(self, script: str, argument: Any = None) -> Any:
        """What a script returns, in which `page` is the page and `argument` the argument."""
        text = f"async (argument) => {{ const page = await window.mitex; {script} }}"
        return self.page.evaluate(text, argument)

    def array(self, expression: str) -> np.ndarray:
        """A typed array of the page, flat."""
        kind, text = self.run(f"const values = {expression}; {BYTES}")
        return np.frombuffer(base64.b64decode(text), kind)

    def maps(self) -> list[np.ndarray]:
        """The maps of the page's picture, four of (H, W, 4), and the ids (H, W, 4), row 0 below."""
        size = self.run("page.draw(); return [page.canvas.height, page.canvas.width, 4]")
        reads = [f"page.graphics.read(page.studio.maps, {k})" for k in range(4)]
        return [
            self.array(read).reshape(size) for read in [*reads, "page.graphics.read(page.studio.picture)"]
        ]

    def picture(self) -> np.ndarray:
        """What the canvas shows, (H, W, 3) in [0, 1], row 0 on top."""
        size = self.run("return [page.canvas.height, page.canvas.width, 4]")
        pixels = self.array("page.pixels()").reshape(size)
        return pixels[::-1, :, :3] / 255
