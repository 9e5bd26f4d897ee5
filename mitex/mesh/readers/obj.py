"""Wavefront OBJ.

Read here and not through trimesh, because a texture that grows along edges needs the connectivity that the
file states: trimesh 5.2 doubles the vertices of every material group, reverses their order, takes relative
indices from the end of the file and reads index 0 as vertex 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mitex.errors import MeshError
from mitex.mesh.readers.budget import Budget
from mitex.mesh.readers.soup import DAMAGED, Soup, polygon_soup

MISSING = -(2**62)  # a corner without texture coordinate or normal


@dataclass
class _Lines:
    """The numbers of all lines; `corners` holds (vertex, uv, normal), 0-based, of polygon after polygon."""

    vertices: list[tuple[float, ...]] = field(default_factory=list)
    uvs: list[tuple[float, ...]] = field(default_factory=list)
    normals: list[tuple[float, ...]] = field(default_factory=list)
    corners: list[tuple[int, int, int]] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)


def read_obj(name: str, data: bytes, budget: Budget) -> Soup:
    """Reads an OBJ file: `v`, `vt`, `vn` and `f` lines; groups, materials, lines and points are ignored.

    Raises:
        MeshError: not an OBJ file, a damaged line, an index that does not exist, too many vertices.
    """
    if b"\0" in data[:4096]:
        raise MeshError(f"{name} is binary, an OBJ file is text", "check its suffix")
    budget.check(name, vertices=data.count(b"\nv ") + data.startswith(b"v "))
    budget.check(name, corners=max(data.count(b"\nvt "), data.count(b"\nvn ")))
    lines = _scan(name, data, budget)
    if not lines.vertices:
        raise MeshError(
            f"{name} holds no vertices", "check that it is an OBJ file and was exported completely"
        )
    budget.check(name, vertices=len(lines.vertices), corners=len(lines.corners))
    corners = np.array(lines.corners, np.int64).reshape(-1, 3)
    uv = _looked_up(name, "texture coordinate", lines.uvs, corners[:, 1], 2)
    normals = _looked_up(name, "normal", lines.normals, corners[:, 2], 3)
    vertices = np.array(lines.vertices, np.float64)
    soup = polygon_soup(name, vertices, corners[:, 0], np.array(lines.sizes, np.int64), uv, normals)
    for what, values, column in (("texture coordinates", uv, 1), ("normals", normals, 2)):
        if values is None and (corners[:, column] != MISSING).any():
            soup.notes.append(f"only some faces have {what}, so they were left out")
    values = [x for x in (uv, normals) if x is not None]
    if values:
        soup.attributes = np.zeros((len(vertices), sum(x.shape[1] for x in values)))
        soup.attributes[corners[:, 0]] = np.concatenate(values, axis=1)
    return soup


def _scan(name: str, data: bytes, budget: Budget) -> _Lines:
    lines = _Lines()
    known: dict[bytes, tuple[int, int, int]] = {}
    for number, line in enumerate(data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines(), 1):
        try:
            _take(lines, line, known)
        except (ValueError, IndexError) as error:
            text = line[:40].decode("ascii", "replace")
            raise MeshError(f"line {number} of {name} is not valid OBJ: '{text}'", DAMAGED) from error
        if len(lines.corners) > budget.corners:
            break  # to be refused
    return lines


def _take(lines: _Lines, line: bytes, known: dict[bytes, tuple[int, int, int]]) -> None:
    words = (line.partition(b"#")[0] if b"#" in line else line).split()
    if not words:
        return
    key = words[0]
    if key == b"v":
        lines.vertices.append((float(words[1]), float(words[2]), float(words[3])))
    elif key == b"f":
        for word in words[1:]:
            corner = known.get(word)
            if corner is None:
                corner = _corner(word, lines)
                if b"-" not in word:
                    known[word] = corner
            lines.corners.append(corner)
        lines.sizes.append(len(words) - 1)
    elif key == b"vn":
        lines.normals.append((float(words[1]), float(words[2]), float(words[3])))
    elif key == b"vt":
        # One-dimensional texture coordinates are allowed.
        lines.uvs.append((float(words[1]), float(words[2]) if len(words) > 2 else 0.0))


def _corner(word: bytes, lines: _Lines) -> tuple[int, int, int]:
    """`v`, `v/vt`, `v//vn` or `v/vt/vn`, 1-based, negative ones counted from the line's place backwards."""
    vertex, uv, normal = (*word.split(b"/"), b"", b"")[:3]
    if not vertex:
        raise ValueError("a corner without vertex")
    counts = len(lines.vertices), len(lines.uvs), len(lines.normals)
    return _index(vertex, counts[0]), _index(uv, counts[1]), _index(normal, counts[2])


def _index(digits: bytes, count: int) -> int:
    if not digits:
        return MISSING
    index = int(digits)
    if index == 0 or abs(index) >= 2**40:
        raise ValueError("no such index")
    return index - 1 if index > 0 else count + index


def _looked_up(
    name: str, what: str, pool: list[tuple[float, ...]], index: np.ndarray, width: int
) -> np.ndarray | None:
    """(N, width) values of the corners, or None where some have none."""
    present = index[index != MISSING]
    if present.size and (present.min() < 0 or present.max() >= len(pool)):
        raise MeshError(f"{name} has a face whose {what} does not exist", DAMAGED)
    if not len(index) or len(present) < len(index):
        return None
    return np.array(pool, np.float64).reshape(-1, width)[index]
