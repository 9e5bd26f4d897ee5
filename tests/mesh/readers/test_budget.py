"""Small files that ask for much: refused, or read in time proportional to them."""

import base64
import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import Mesh, icosphere
from tests.mesh.examples import FAN_POINTS, TETRAHEDRON, gltf, obj_text, ply_bytes

ROOT = Path(__file__).parents[3]
CPU, MEMORY = 40, 3 << 30  # of the process that reads them all [s], [bytes]


def tree_of(primitives: list[dict], nodes: int, **accessor) -> str:
    """A glTF whose nodes all have one mesh of these primitives; `accessor` is a further one, number 2."""
    tree, blob = gltf([{"positions": FAN_POINTS, "indices": TETRAHEDRON}])
    uri = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
    tree["buffers"] = [{"uri": uri, "byteLength": len(blob)}]
    tree["meshes"] = [{"primitives": primitives}]
    tree["nodes"] = [{"mesh": 0}] * nodes
    tree["accessors"].append({"componentType": 5125, "type": "SCALAR", "count": 0, **accessor})
    return json.dumps(tree)


def bombs() -> dict[str, bytes | str]:
    plain = {"attributes": {"POSITION": 0}, "indices": 1}
    points = {"attributes": {"POSITION": 0}, "mode": 0}
    corners = " ".join(str(k + 1) for k in range(2000))
    rng = np.random.default_rng(0)
    scattered = "\n".join(f"v {x} {y} 0" for x, y in rng.random((2000, 2)))
    header = "ply\nformat binary_little_endian 1.0\nelement {}\nproperty list {} uchar a\nend_header\n"
    return {
        "corners.obj": f"{scattered}\nf {corners}",
        "instances.gltf": tree_of([plain] * 3000, 30_000),
        "points.gltf": tree_of([points] * 30_000, 30_000),
        "zeros.gltf": tree_of([{**plain, "indices": 2}] * 60, 1, count=11_999_988),
        "normals.gltf": tree_of([{"attributes": {"POSITION": 0, "NORMAL": 2}}], 1, count=10**9, type="VEC3"),
        "long list.ply": header.format("vertex 1", "uint").encode() + b"\xff\xff\xff\x7f" + bytes(99),
        "wide list.ply": header.format("face 1", "uint").encode() + b"\0\0\0\x20" + bytes(99),
        "infinite.ply": "ply\nformat ascii 1.0\nelement face 1\nproperty list float int a\nend_header\ninf 1",
    }


def read_all(folder: Path) -> None:
    """In a process that may not take more: prints each file's name and what became of it."""
    for file in sorted(folder.iterdir()):
        try:
            Mesh.load(file)
            print(f"{file.name}: read")
        except MeshError as error:
            print(f"{file.name}: {error}")


def test_bombs(tmp_path):
    files = bombs()
    for name, data in files.items():
        (tmp_path / name).write_bytes(data.encode() if isinstance(data, str) else data)

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU, CPU))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))

    code = f"from tests.mesh.readers.test_budget import *; read_all(Path({str(tmp_path)!r}))"
    process = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        cwd=ROOT,
        env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=limit,
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stdout + process.stderr[-2000:]
    results = dict(line.split(": ", 1) for line in process.stdout.splitlines())
    assert results.pop("corners.obj") == "read"
    assert len(results) == len(files) - 1
    assert all("budget" in results[name] for name in ("instances.gltf", "zeros.gltf"))
    assert "no vertices" in results["points.gltf"]
    assert all("; " in result and result.count("budget") <= 1 for result in results.values())


def test_many_triangles_and_quads_are_read_as_they_are(tmp_path):
    """As fast as the file is large, with the values of the row of each face."""
    rng = np.random.default_rng(1)
    faces = [rng.permutation(200)[: rng.integers(3, 5)] for _ in range(20_000)]
    (tmp_path / "a.ply").write_bytes(ply_bytes(rng.random((200, 3)), faces))
    with pytest.warns(MeshWarning):
        mesh = Mesh.load(tmp_path / "a.ply")
    corners = {tuple(sorted(face)) for face in mesh.faces.tolist()}
    triangles = [tuple(sorted(face.tolist())) for face in faces if len(face) == 3]
    assert len(triangles) > 9000 and corners.issuperset(triangles)


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "gltf"])
def test_far_from_the_origin_a_mesh_keeps_its_shape(tmp_path, suffix):
    ball = icosphere(3)
    path = tmp_path / f"a.{suffix}"
    if suffix == "obj":
        lines = obj_text(ball).splitlines()
        path.write_text("\n".join(moved(line) for line in lines))
    elif suffix == "ply":
        points = ball.vertices.astype(np.float64) + 1e7
        rows = "\n".join(" ".join(map(repr, p)) for p in points.tolist())
        faces = "\n".join("3 " + " ".join(map(str, f)) for f in ball.faces.tolist())
        kinds = "\n".join(f"property double {axis}" for axis in "xyz")
        path.write_text(
            f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{kinds}\nelement face {len(ball.faces)}\n"
            f"property list uchar int vertex_indices\nend_header\n{rows}\n{faces}\n"
        )
    elif suffix == "off":
        points = ball.vertices.astype(np.float64) + 1e7
        rows = "\n".join(" ".join(map(repr, p)) for p in points.tolist())
        faces = "\n".join("3 " + " ".join(map(str, f)) for f in ball.faces.tolist())
        path.write_text(f"OFF\n{len(points)} {len(ball.faces)} 0\n{rows}\n{faces}\n")
    else:
        part = {"positions": ball.vertices, "indices": ball.faces.astype(np.uint32)}
        tree, blob = gltf([part], [{"mesh": 0, "translation": [1e7, 1e7, 1e7]}])
        uri = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
        tree["buffers"] = [{"uri": uri, "byteLength": len(blob)}]
        path.write_text(json.dumps(tree))
    with pytest.warns(MeshWarning, match="far from the origin"):
        mesh = Mesh.load(path)
    assert len(mesh.faces) == len(ball.faces)
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(np.ones(len(mesh.vertices)), abs=1e-5)


def moved(line: str) -> str:
    key, *numbers = line.split()
    return line if key != "v" else " ".join(["v", *(repr(float(n) + 1e7) for n in numbers)])
