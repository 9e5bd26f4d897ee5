"""Rendering of a vertex field, forward and backward: `Stage.visibility` + `bridge.lookup` beside naive ways.

Run it as `python -m benchmarks.lookup`. The default is the paper's training step: 40,962 vertices, 6 views of
320 x 320. Every number is the best of several repetitions, in one process, of the same gradient.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import torch

from mitex.bridge import lookup, render
from mitex.mesh import icosphere
from mitex.scenes import Cameras, patch_views, random_views
from mitex.scenes.stage import Stage, Visibility, mi


def best(function: Callable[[], object], repetitions: int = 7) -> float:
    """Shortest time of several calls [ms]."""
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def gather(field: torch.Tensor, visibility: Visibility) -> torch.Tensor:
    """The naive lookup: torch gathers three vertices per pixel, autograd scatters."""
    values = (field[visibility.vertex_index] * visibility.weight[..., None]).sum(1)
    flat = torch.zeros(visibility.coverage.numel(), field.shape[1])
    return flat.index_copy(0, visibility.pixel, values).view(*visibility.shape, -1)


def backward(image: Callable[[torch.Tensor], torch.Tensor], field: torch.Tensor) -> torch.Tensor:
    """Gradient of half the image's squared sum."""
    attached = field.detach().requires_grad_()
    picture = image(attached)
    picture.backward(picture.detach())
    assert attached.grad is not None
    return attached.grad


def batch_sensor(cameras: Cameras):
    """All cameras side by side in one Mitsuba sensor."""
    count, height, width = cameras.shape
    film = {"type": "hdrfilm", "width": count * width, "height": height, "rfilter": {"type": "box"}}
    views = {f"view{k}": sensor for k, sensor in enumerate(cameras.sensors())}
    return mi.load_dict({"type": "batch", "film": film} | views)


def view_by_view(stage: Stage, cameras: Cameras, field: torch.Tensor) -> torch.Tensor:
    """The naive whole: one wavefront and one gather per view."""
    images = []
    for k in range(len(cameras)):
        one = {name: getattr(cameras, name)[k : k + 1] for name in ("origin", "target", "up")}
        images.append(gather(field, stage.visibility(replace(cameras, **one))))
    return torch.cat(images)


def compare(stage: Stage, cameras: Cameras, channels: int) -> list[tuple[str, float, float]]:
    """(way, milliseconds, times faster than the naive one of its group) of forward plus backward."""
    field = torch.rand(len(stage.mesh.vertices), channels)
    visibility, sensor = stage.visibility(cameras), batch_sensor(cameras)
    lookups: dict[str, Callable[[torch.Tensor], torch.Tensor]] = {
        "lookup: torch gather + autograd": lambda f: gather(f, visibility),
        "lookup: bridge.lookup": lambda f: lookup(f, visibility),
    }
    wholes: dict[str, Callable[[torch.Tensor], torch.Tensor]] = {
        "whole: view by view, torch gather": lambda f: view_by_view(stage, cameras, f),
        "whole: Stage.visibility + lookup": lambda f: lookup(f, stage.visibility(cameras)),
        "whole: bridge.render (Mitsuba)": lambda f: render(stage.scene, f, sensor),
    }
    rows = []
    for group in (lookups, wholes):
        naive, *others = (backward(image, field) for image in group.values())
        # A ray on an edge may fall on either side: compare the whole, not each vertex.
        assert all((naive - other).norm() < 1e-2 * naive.norm() for other in others)
        times = {way: best(partial(backward, image, field)) for way, image in group.items()}
        slowest = next(iter(times.values()))
        rows += [(way, milliseconds, slowest / milliseconds) for way, milliseconds in times.items()]
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frequency", type=int, default=64, help="of the icosphere; 10 f^2 + 2 vertices")
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--resolution", type=int, default=320)
    parser.add_argument("--channels", type=int, nargs="*", default=[3, 9])
    options = parser.parse_args()

    mesh, generator = icosphere(options.frequency), torch.Generator().manual_seed(0)
    views = {
        "full views": random_views(generator, options.views, resolution=options.resolution),
        "patches": patch_views(generator, mesh, options.views, 0.55, options.resolution),
    }
    for channels in options.channels:
        stage = Stage(mesh, channels)
        for name, cameras in views.items():
            print(f"\n{name}, {cameras.shape}, {len(mesh.vertices)} vertices, {channels} channels")
            for way, milliseconds, ratio in compare(stage, cameras, channels):
                print(f"  {way:36s} {milliseconds:8.1f} ms   {ratio:5.1f} x")


if __name__ == "__main__":
    main()
