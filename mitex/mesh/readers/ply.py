"""Stanford PLY, text and binary.

Read here and not through trimesh, because trimesh 5.2 refuses binary files that mix triangles and quads
(Blender's default) and cuts vertices apart at UV seams.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from itertools import accumulate

import numpy as np

from mitex.errors import MeshError
from mitex.mesh.readers.budget import Budget
from mitex.mesh.readers.soup import DAMAGED, Soup, check_indices, polygon_soup

# Types by any of their names, as numpy codes without byte order.
TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    "int64": "i8",
    "uint64": "u8",
}
UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
NORMAL_NAMES = ("nx", "ny", "nz")
MAX_HEADER = 1 << 16


@dataclass
class _Element:
    """What the header says of one table."""

    name: str
    count: int
    # (name, type of the list's length or None for a single number, type)
    properties: list[tuple[str, str | None, str]] = field(default_factory=list)


@dataclass
class _Ragged:
    """Lists of numbers, one after the other, and their lengths."""

    values: np.ndarray
    sizes: np.ndarray


def read_ply(name: str, data: bytes, budget: Budget) -> Soup:
    """Reads a PLY file: positions, faces, and UVs and normals where there are some.

    Raises:
        MeshError: not a PLY file, a damaged header, data that end early, too many vertices.
    """
    return soup_of_tables(name, read_tables(name, data, budget)[0])


def read_tables(name: str, data: bytes, budget: Budget) -> tuple[dict[str, dict], int]:
    """The elements of a PLY file up to vertices and faces, and how many bytes or numbers come after them.

    Returns:
        Element -> property -> (count,) values; lists of numbers as an object of their own.

    Raises:
        MeshError: as `read_ply`.
    """
    order, elements, start = _header(name, data)
    for element in elements:
        if element.name == "vertex":
            budget.check(name, vertices=element.count)
        if element.properties and element.count > len(data):
            problem = f"{name} promises {element.count:,} {element.name} elements, more than it has bytes"
            raise MeshError(problem, DAMAGED)
        if element.properties:
            budget.check(name, corners=element.count)
    body = _Text(name, data[start:]) if order == "" else _Binary(name, data, start, order)
    tables: dict[str, dict] = {}
    for element in elements:
        tables[element.name] = _read_element(body, element)
        if "vertex" in tables and "face" in tables:
            break
    return tables, body.end - body.position


def soup_of_tables(name: str, tables: dict[str, dict]) -> Soup:
    """The mesh in the elements of a PLY file.

    Raises:
        MeshError: no positions, or an index that does not exist.
    """
    points = tables.get("vertex", {})
    if not all(axis in points for axis in "xyz"):
        raise MeshError(
            f"{name} holds no vertex positions x, y, z", "export it as a mesh with vertices and faces"
        )
    vertices = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
    table = tables.get("face", {})
    lists = table.get("vertex_indices", table.get("vertex_index"))
    if not isinstance(lists, _Ragged):
        lists = _Ragged(np.empty(0, np.int64), np.empty(0, np.int64))
    with np.errstate(invalid="ignore"):
        corners = lists.values.astype(np.int64)
    check_indices(name, corners, len(vertices))
    uv_columns = next((names for names in UV_NAMES if all(n in points for n in names)), ())
    texcoord = table.get("texcoord")
    uv = normals = None
    if isinstance(texcoord, _Ragged) and np.array_equal(texcoord.sizes, 2 * lists.sizes):
        uv = texcoord.values.astype(np.float64).reshape(-1, 2)
    elif uv_columns:
        uv = _gathered(points, uv_columns, corners)
    if all(n in points for n in NORMAL_NAMES):
        normals = _gathered(points, NORMAL_NAMES, corners)
    soup = polygon_soup(name, vertices, corners, lists.sizes.astype(np.int64), uv, normals)
    columns = [points[n] for n in (*uv_columns, *NORMAL_NAMES) if n in points]
    if columns:
        soup.attributes = np.stack(columns, axis=1).astype(np.float64)
    return soup


def _gathered(points: dict[str, np.ndarray], columns: tuple[str, ...], corners: np.ndarray) -> np.ndarray:
    """(N, k) float64 values of vertex columns at corners (N,)."""
    return np.stack([points[n] for n in columns], axis=1).astype(np.float64)[corners]


def _header(name: str, data: bytes) -> tuple[str, list[_Element], int]:
    """The byte order ('<', '>', or '' for text), the elements, and where their data start."""
    end = data.find(b"end_header", 0, MAX_HEADER)
    if not data.startswith(b"ply") or end < 0:
        raise MeshError(f"{name} is not a PLY file", "check its suffix and how it was exported")
    newline = data.find(b"\n", end)
    start = newline + 1 if newline >= 0 else len(data)
    order, elements = None, []
    for line in data[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2])))
                if elements[-1].count < 0:
                    raise ValueError
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], TYPES[words[2]], TYPES[words[3]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append((words[2], None, TYPES[words[1]]))
        except (KeyError, IndexError, ValueError) as error:
            raise MeshError(f"the PLY header of {name} has a bad line: '{line[:60]}'", DAMAGED) from error
    if order is None:
        raise MeshError(f"the PLY header of {name} names no format", DAMAGED)
    return order, elements, start


class _Binary:
    """Reads numbers from bytes; positions are counted in bytes."""

    def __init__(self, name: str, data: bytes, start: int, order: str):
        self.name, self.data, self.position, self.order = name, data, start, order
        self.end = len(data)

    def dtype(self, kind: str) -> np.dtype:
        """The type of a number of that kind."""
        return np.dtype(self.order + kind)

    def width(self, kind: str) -> int:
        """How many positions a number takes."""
        return self.dtype(kind).itemsize

    def number(self, position: int, kind: str) -> float:
        """The number at a position."""
        return np.frombuffer(self.data, self.dtype(kind), 1, position)[0].item()

    def numbers(self, kept: np.ndarray, start: int, kind: str) -> np.ndarray:
        """The numbers at those positions from `start` on that `kept` (N,) bool tells."""
        return np.frombuffer(self.data, np.uint8, len(kept), start)[kept].view(self.dtype(kind))

    def table(self, columns: list[tuple[str, str, int]], count: int) -> dict[str, np.ndarray] | None:
        """`count` rows of columns (name, type, width), each (count, width); None if the data end before."""
        # Numbered fields, because the header may repeat a name.
        fields = [(str(k), self.order + kind, (width,)) for k, (_, kind, width) in enumerate(columns)]
        length = sum(self.width(kind) * width for _, kind, width in columns)
        if self.position + length * count > self.end:
            return None
        if not length:
            return {name: np.empty((count, 0), kind) for name, kind, _ in columns}
        rows = np.frombuffer(self.data, np.dtype(fields), count, self.position)
        self.position += length * count
        return {name: rows[str(k)] for k, (name, _, _) in enumerate(columns)}


class _Text:
    """Reads numbers from text; positions are counted in numbers."""

    def __init__(self, name: str, text: bytes):
        self.name, self.position = name, 0
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)  # numpy's of text that is no number
                self.values = np.fromstring(text, sep=" ")
        except (ValueError, DeprecationWarning) as error:
            raise MeshError(f"{name} has something between its numbers that is none", DAMAGED) from error
        self.end = len(self.values)

    def width(self, kind: str) -> int:
        """How many positions a number takes."""
        return 1

    def number(self, position: int, kind: str) -> float:
        """The number at a position."""
        return self.values[position].item()

    def numbers(self, kept: np.ndarray, start: int, kind: str) -> np.ndarray:
        """The numbers at those positions from `start` on that `kept` (N,) bool tells."""
        return self.values[start : start + len(kept)][kept]

    def table(self, columns: list[tuple[str, str, int]], count: int) -> dict[str, np.ndarray] | None:
        """As of `_Binary`."""
        ends = list(accumulate(width for _, _, width in columns))
        if self.position + ends[-1] * count > self.end:
            return None
        rows = self.values[self.position : self.position + ends[-1] * count].reshape(count, ends[-1])
        self.position += ends[-1] * count
        return {name: rows[:, end - width : end] for (name, _, width), end in zip(columns, ends, strict=True)}


def _read_element(body: _Binary | _Text, element: _Element) -> dict:
    """Columns by name: (count,) arrays, and `_Ragged` ones for lists."""
    if not element.properties:
        return {}
    start = body.position
    rows = _uniform(body, element)
    if rows is None:
        body.position = start
        rows = _row_by_row(body, element)
    return rows


def _uniform(body: _Binary | _Text, element: _Element) -> dict | None:
    """All rows at once, if their lists are as long as those of the first row; otherwise None."""
    start = body.position
    first = _row_by_row(body, replace(element, count=min(element.count, 1)))
    body.position = start
    columns, lengths = [], {}
    for name, size_type, kind in element.properties:
        if size_type:
            lengths[name] = int(first[name].sizes.sum())
            columns.append((f"{name} size", size_type, 1))
        columns.append((name, kind, lengths.get(name, 1)))
    table = body.table(columns, element.count)
    if table is None:
        return None
    result: dict = {}
    for name, size_type, _ in element.properties:
        values = table[name]
        if size_type:
            sizes = table[f"{name} size"][:, 0]
            if not (sizes == lengths[name]).all():
                return None
            result[name] = _Ragged(values.ravel(), sizes.astype(np.int64))
        else:
            result[name] = values[:, 0]
    return result


def _row_by_row(body: _Binary | _Text, element: _Element) -> dict:
    """Lists of different lengths: row by row only where they are, then all of a property at once."""
    starts = {name: np.zeros(element.count, np.int64) for name, _, _ in element.properties}
    sizes = {name: np.ones(element.count, np.int64) for name, _, _ in element.properties}
    begin = position = body.position
    for row in range(element.count):
        for name, size_type, kind in element.properties:
            size = 1
            if size_type:
                size = _list_size(body, element, position, size_type)
                position += body.width(size_type)
            starts[name][row], sizes[name][row] = position - begin, size
            position += size * body.width(kind)
            if position > body.end:
                raise _too_short(body, element)
    body.position, result = position, {}
    for name, size_type, kind in element.properties:
        ends = starts[name] + sizes[name] * body.width(kind)
        flat = body.numbers(_covered(starts[name], ends, position - begin), begin, kind)
        result[name] = _Ragged(flat, sizes[name]) if size_type else flat
    return result


def _covered(starts: np.ndarray, ends: np.ndarray, length: int) -> np.ndarray:
    """(length,) bool: what lies in one of the half-open intervals, which do not overlap."""
    long = ends > starts
    change = np.zeros(length + 1, np.int8)
    change[starts[long]] += 1
    change[ends[long]] -= 1
    return np.cumsum(change[:-1], dtype=np.int8).astype(bool)


def _list_size(body: _Binary | _Text, element: _Element, position: int, kind: str) -> int:
    if position + body.width(kind) > body.end:
        raise _too_short(body, element)
    size = body.number(position, kind)
    if not 0 <= size < 2**31:
        raise MeshError(f"{body.name} has a {element.name} list of {size} numbers", DAMAGED)
    if size > body.end - position:
        raise _too_short(body, element)
    return int(size)


def _too_short(body: _Binary | _Text, element: _Element) -> MeshError:
    return MeshError(f"{body.name} ends before its {element.count} {element.name} elements do", DAMAGED)
