"""MikkTSpace by the npm package `mikktspace`, a WebAssembly build of a public implementation."""

from pathlib import Path

import numpy as np

from tests.node import run_node

GENERATE = """
const { generateTangents } = require('mikktspace'), fs = require('fs');
const [input, output, count] = process.argv.slice(1);
const bytes = fs.readFileSync(input), all = new Float32Array(bytes.buffer, bytes.byteOffset, 8 * count);
const [p, n, t] = [all.slice(0, 3 * count), all.slice(3 * count, 6 * count), all.slice(6 * count)];
fs.writeFileSync(output, Buffer.from(generateTangents(p, n, t).buffer));
"""


def mikktspace(
    positions: np.ndarray, normals: np.ndarray, uv: np.ndarray, folder: Path
) -> tuple[np.ndarray, np.ndarray]:
    """(F, 3, 3) tangents and (F, 3) signs of corners (F, 3, 3), (F, 3, 3) and (F, 3, 2), v upwards."""
    values = np.concatenate([a.astype("<f4").ravel() for a in (positions, normals, uv)])
    (folder / "corners").write_bytes(values.tobytes())
    count = 3 * len(positions)
    run_node("mikktspace", GENERATE, folder / "corners", folder / "tangents", count)
    tangents = np.frombuffer((folder / "tangents").read_bytes(), "<f4").reshape(-1, 3, 4)
    return tangents[..., :3].astype(np.float64), tangents[..., 3]
