"""Charts that xatlas flattens and packs, in a process of its own.

A mesh that xatlas cannot cope with crashes it, and as it ends it may wait forever for one of its own threads
(they can miss their last wake-up). In another process neither harms the one that asked.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from safetensors.numpy import load, save

from mitex.errors import MeshError

Part = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Packing:
    """How charts are put side by side.

    Attributes:
        resolution: side of the map that they are packed for [texels].
        padding: gap between them [texels].
        largest: most area of a chart that is still to be flattened [square of the vertices' unit]; 0: any.
    """

    resolution: int
    padding: int
    largest: float = 0.0


def packed_charts(parts: Sequence[Part], packing: Packing, name: str) -> list[np.ndarray]:
    """Cuts parts of a surface into charts, flattens them and packs all into one square.

    Args:
        parts: of the surface, each its (V, 3) vertices and (F, 3) faces; with (V, 2) vertices, charts that
            are flat already and are only packed.
        packing: how.
        name: of the mesh, for messages.

    Returns:
        For each part (F, 3, 2) float32 corners in [0, 1], v upwards; degenerate faces get (0, 0).

    Raises:
        MeshError: xatlas did not survive the mesh.
    """
    arrays = {}
    for k, (vertices, faces) in enumerate(parts):
        arrays[f"vertices.{k}"] = np.ascontiguousarray(vertices, np.float32)
        arrays[f"faces.{k}"] = np.ascontiguousarray(faces, np.uint32)
    process = subprocess.run(
        [sys.executable or "python3", "-P", "-m", __name__, json.dumps(asdict(packing))],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)},
        input=save(arrays),
        capture_output=True,
        check=False,
    )
    if process.returncode:
        said = process.stderr.decode(errors="replace").strip().splitlines()
        reason = said[-1][:200] if said else f"code {process.returncode}"
        raise MeshError(
            f"{name} cannot be unwrapped: xatlas failed ({reason})",
            "give the mesh UVs, or repair or simplify it",
        )
    result = load(process.stdout)
    return [result[str(k)] for k in range(len(parts))]


def _generate(arrays: dict[str, np.ndarray], packing: Packing) -> dict[str, np.ndarray]:
    """What the other process does: the corners of each part, by its number."""
    import xatlas

    atlas = xatlas.Atlas()
    count = len(arrays) // 2
    for k in range(count):
        vertices, faces = arrays[f"vertices.{k}"], arrays[f"faces.{k}"]
        (atlas.add_mesh if vertices.shape[1] == 3 else atlas.add_uv_mesh)(vertices, faces)
    chart, pack = xatlas.ChartOptions(), xatlas.PackOptions()
    chart.max_chart_area = packing.largest
    pack.resolution, pack.padding, pack.bilinear = packing.resolution, packing.padding, True
    atlas.generate(chart, pack)
    # Back to texels and down by one factor, so that texels stay square.
    side = np.array([atlas.width, atlas.height], np.float32)
    corners = {}
    for k in range(count):
        _, faces, uv = atlas.get_mesh(k)
        corners[str(k)] = np.clip(uv * side / side.max(), 0.0, 1.0)[faces.astype(np.int64)]
    return corners


def _main() -> None:
    corners = _generate(load(sys.stdin.buffer.read()), Packing(**json.loads(sys.argv[1])))
    sys.stdout.buffer.write(save(corners))
    sys.stdout.buffer.flush()
    os._exit(0)  # without waiting for the threads of xatlas


if __name__ == "__main__":
    _main()
