"""STL and OFF, through trimesh."""

from __future__ import annotations

import io
import logging
import struct

import numpy as np

from mitex.errors import MeshError
from mitex.mesh.readers.budget import Budget
from mitex.mesh.readers.soup import DAMAGED, Soup, check_indices

NOT_A_MESH = "check its suffix and how it was exported"


def read_stl(name: str, data: bytes, budget: Budget) -> Soup:
    """Reads an STL file, text or binary. Its triangles are separate; the caller welds them.

    Raises:
        MeshError: not an STL file, data that end early, too many triangles.
    """
    if data[:5].lower() == b"solid" and b"\0" not in data[:1024]:
        faces = data.count(b"endfacet") or data.count(b"ENDFACET")
    elif len(data) < 84:
        raise MeshError(f"{name} is not an STL file", NOT_A_MESH)
    else:
        faces = struct.unpack_from("<I", data, 80)[0]
        if len(data) < 84 + 50 * faces:
            problem = f"{name} promises {faces:,} triangles but is {len(data):,} bytes long"
            raise MeshError(problem, DAMAGED)
        data = data[: 84 + 50 * faces]  # some programs append their own data
    budget.check(name, vertices=faces // 2)  # a closed mesh has twice as many faces as vertices
    vertices, triangles = _trimesh(name, data, "stl")
    return Soup(vertices, triangles, split=True)


def read_off(name: str, data: bytes, budget: Budget) -> Soup:
    """Reads an OFF file.

    Raises:
        MeshError: not an OFF file, damaged or short data, too many vertices.
    """
    words = b" ".join(line.partition(b"#")[0] for line in data[:4096].splitlines()).split(maxsplit=4)
    if not words or words[0] not in (b"OFF", b"COFF") or len(words) < 3:
        raise MeshError(f"{name} is not an OFF file", NOT_A_MESH)
    try:
        count, faces = int(words[1]), int(words[2])
    except ValueError as error:
        raise MeshError(f"{name} does not say how many vertices and faces it has", DAMAGED) from error
    budget.check(name, vertices=count, corners=3 * faces)
    if count < 0 or faces < 0 or count + faces > len(data):
        raise MeshError(f"{name} promises {count:,} vertices and {faces:,} faces, too many for it", DAMAGED)
    if not faces:
        return Soup(np.zeros((count, 3)), np.empty((0, 3), np.int64))
    vertices, triangles = _trimesh(name, data, "off")
    if len(vertices) != count or len(triangles) < faces:
        raise MeshError(f"{name} ends before its {count} vertices and {faces} faces do", DAMAGED)
    check_indices(name, triangles, count)
    return Soup(vertices, triangles)


def _trimesh(name: str, data: bytes, kind: str) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    log = logging.getLogger("trimesh")
    level = log.level
    log.setLevel(logging.CRITICAL)  # it logs tracebacks of what it then gets over
    try:
        scene = trimesh.load_scene(
            io.BytesIO(data), file_type=kind, process=False, maintain_order=True, skip_materials=True
        )
        parts = [g for g in scene.geometry.values() if isinstance(g, trimesh.Trimesh)]
    except Exception as error:
        reason = " ".join(str(error).split())[:200]
        raise MeshError(f"{name} cannot be read as {kind.upper()} ({reason})", DAMAGED) from error
    finally:
        log.setLevel(level)
    if not parts:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = [np.asarray(part.faces, np.int64) + start for part, start in zip(parts, starts, strict=True)]
    return np.concatenate([np.asarray(p.vertices, np.float64) for p in parts]), np.concatenate(faces)
