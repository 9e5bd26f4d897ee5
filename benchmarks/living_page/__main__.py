"""How fast the living page is in Chromium without a graphics card, and how large its file.

usage: python -m benchmarks.living_page [--quick]

Steps of the automaton in several ways on the same mesh, in turns: four passes as on MeshNCA's own page, the
page's one pass in WebGL2, and its compute shader in WebGPU, with the states brought to WebGL2 once at the end
or, as while it is drawn, after each step; and with states that are carried along a field. Pictures of
512 x 512 pixels. Times are those that processors worked for the browser, so that other work on the machine
counts little; the least of several.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture, living_page
from tests.browser import Browser, Tab

REFERENCE = (Path(__file__).parent / "four_passes.js").read_text()
TIMED = "const wait = () => page.graphics.read(page.automaton.states[0], 0, 0, 0, 1, 1); %s;"
TICKS = os.sysconf("SC_CLK_TCK")  # of the clock of processes, a second
WAYS = {
    "four passes": "for (let k = 0; k < argument; k++) reference.step(7 * k % 64); reference.wait()",
    "one pass (WebGL2)": "await page.step(argument); wait()",
    "compute (WebGPU)": "await page.step(argument); wait()",
    "compute, brought each step": "for (let k = 0; k < argument; k++) await page.step(1); wait()",
    "one pass, flowing": "await page.step(argument); wait()",
    "compute, flowing": "await page.step(argument); wait()",
    "picture": "page.pixels()",
}


def milliseconds(tab: Tab, way: str, count: int) -> float:
    """What one step takes of processors' time."""
    tab.run("page.move(argument, 1)", "right" if way.endswith("flowing") else None)
    begun = worked()
    tab.run(TIMED % WAYS[way], count)
    return 1000 * (worked() - begun) / count


def worked() -> float:
    """How long processors have worked for the browser that this program has started [s]."""
    parents, ticks = {}, {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended
            fields = file.read_text().rpartition(")")[2].split()
            process = int(file.parent.name)
            parents[process], ticks[process] = int(fields[1]), int(fields[11]) + int(fields[12])

    def ours(process: int) -> bool:
        return process == os.getpid() or (process in parents and ours(parents[process]))

    return sum(ticks[process] for process in parents if ours(process) and process != os.getpid()) / TICKS


def pages(browser: Browser, frequency: int, folder: Path) -> tuple[Path, Tab, Tab]:
    """The file, and the page in it with WebGL2, which has the reference, and with WebGPU."""
    path = folder / f"{frequency}.html"
    living_page(NcaTexture.load("pebbles"), icosphere(frequency), path, steps=1, subdivide=0)
    tab, compute = browser.open(path, 512), browser.open(path, 512, steps="webgpu")
    tab.page.evaluate(
        f"async () => {{ const page = await window.mitex; window.reference = (() => {{ {REFERENCE} }})(); }}"
    )
    return path, tab, compute


def check(tab: Tab) -> None:
    """The reference computes the same step for cells that take part in it in both ways."""
    apart, both = tab.run(
        """await page.step(20); const before = page.automaton.read();
        reference.write(before); reference.step(3); await page.step(1);
        const [ours, theirs] = [page.automaton.read(), reference.read()];
        let apart = 0, both = 0;
        for (let v = 0; v < page.surface.mesh.count; v++) {
          const moved = ours.subarray(16 * v, 16 * v + 16).some((x, c) => x !== before[16 * v + c]);
          if (!moved || !reference.active(v, 3)) continue;
          both++;
          for (let c = 16 * v; c < 16 * v + 16; c++) apart = Math.max(apart, Math.abs(ours[c] - theirs[c]));
        }
        return [apart, both / page.surface.mesh.count]"""
    )
    assert apart < 1e-4 and 0.15 < both < 0.35, (apart, both)


def measure(
    browser: Browser, frequency: int, folder: Path, rounds: int, count: int
) -> tuple[int, dict[str, float]]:
    """Size of the file [bytes], and milliseconds by way."""
    path, tab, compute = pages(browser, frequency, folder)
    check(tab)
    tabs = {way: compute if way.startswith("compute") else tab for way in WAYS}
    times = [
        {way: milliseconds(one, way, 1 if way == "picture" else count) for way, one in tabs.items()}
        for _ in range(rounds + 1)
    ]
    assert tab.errors == compute.errors == []
    return path.stat().st_size, {way: float(np.min([row[way] for row in times[1:]])) for way in WAYS}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a small mesh: shows that it runs")
    quick = parser.parse_args().quick
    browser = Browser()
    frequencies, rounds, count = ((8,), 1, 4) if quick else ((32, 64), 3, 10)
    console = Console()
    with tempfile.TemporaryDirectory() as folder:
        for frequency in frequencies:
            size, times = measure(browser, frequency, Path(folder), rounds, count)
            cells = 10 * frequency**2 + 2
            table = Table(f"{cells:,} cells, {size / 1000:.0f} kB", "ms", "a second", "times as fast")
            for way, ms in times.items():
                ratio = "" if way == "picture" else f"{times['four passes'] / ms:.2f}"
                table.add_row(way, f"{ms:.1f}", f"{1000 / ms:.1f}", ratio)
            console.print(table)
    browser.close()


if __name__ == "__main__":
    main()
