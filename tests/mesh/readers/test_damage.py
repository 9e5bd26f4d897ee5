"""Whatever happens to a file, it gives a mesh or a MeshError, never another exception."""

import warnings

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mitex.errors import MeshError
from mitex.mesh import Mesh, icosphere
from tests.mesh.examples import (
    FAN_POINTS,
    TETRAHEDRON,
    exported_by_trimesh,
    glb_bytes,
    gltf,
    obj_text,
    ply_bytes,
)

SMALL = icosphere(1)
UV = FAN_POINTS[:, :2].astype("<f4")
FILES = {
    "obj": (obj_text(SMALL) + "vt 0 0\nf 1/1 2/1 -1/1 -2/1\n").encode(),
    "ply": ply_bytes(FAN_POINTS, [[0, 1, 2, 3], [0, 1, 2]]),
    "stl": exported_by_trimesh(SMALL, "stl"),
    "text.stl": exported_by_trimesh(SMALL, "stl_ascii"),
    "text.ply": exported_by_trimesh(SMALL, "ply", encoding="ascii"),
    "off": exported_by_trimesh(SMALL, "off"),
    "glb": glb_bytes(*gltf([{"positions": FAN_POINTS, "indices": TETRAHEDRON, "uv": UV}])),
}


@st.composite
def damages(draw, data: bytes) -> bytes:
    """`data` with a few bytes changed, a part left out or repeated."""
    start = draw(st.integers(0, len(data)))
    end = draw(st.integers(start, len(data)))
    kind = draw(st.sampled_from(["cut", "drop", "repeat", "bytes", "digits"]))
    if kind == "cut":
        return data[:start]
    if kind == "drop":
        return data[:start] + data[end:]
    if kind == "repeat":
        return data[:end] + data[start:]
    changed = bytearray(data)
    pool = st.integers(0, 255) if kind == "bytes" else st.sampled_from(list(b'0123456789-. e/\n"[]{},'))
    for _ in range(draw(st.integers(1, 4))):
        changed[draw(st.integers(0, len(data) - 1))] = draw(pool)
    return bytes(changed)


@pytest.mark.parametrize("kind", FILES)
@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(draw=st.data())
def test_damaged_files(kind, tmp_path, draw):
    path = tmp_path / f"a.{kind}"
    path.write_bytes(draw.draw(damages(FILES[kind])))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            mesh = Mesh.load(path, max_vertices=1000)
        except MeshError as error:
            assert "a." in error.problem
            assert "\n" not in str(error)
        else:
            assert len(mesh.faces) > 0
