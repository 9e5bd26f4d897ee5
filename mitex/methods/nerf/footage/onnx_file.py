"""What an ONNX file says of its network, read without running anything of it.

The file is a protobuf message; numbers of fields are those of onnx.proto (https://github.com/onnx/onnx).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mitex.methods.nerf.footage.mask_method import SIDES

FLOAT = 1  # TensorProto.DataType
EXTERNAL = 1  # TensorProto.DataLocation


@dataclass(frozen=True)
class Declared:
    """What a network takes and gives.

    Attributes:
        height, width: of the picture [pixels]; None where any will do.
        output: name of the first output.
    """

    height: int | None
    width: int | None
    output: str


def declared(data: bytes) -> Declared:
    """Reads the head of an ONNX file.

    Args:
        data: the file.

    Raises:
        ValueError: it is no such file, is cut short, or its network does not take one float32 picture
            1 x 3 x H x W.
    """
    graphs = [value for number, value in _fields(memoryview(data)) if number == 7]
    if len(graphs) != 1:
        raise ValueError("it holds no graph")
    graph = list(_fields(_message(graphs[0])))
    weights = {_weight(_message(value)) for number, value in graph if number == 5}
    inputs = [_message(value) for number, value in graph if number == 11]
    pictures = [value for value in inputs if _name(value) not in weights]  # old files list weights as well
    outputs = [_name(_message(value)) for number, value in graph if number == 12]
    if len(pictures) != 1 or not outputs:
        raise ValueError(f"it has {len(pictures)} inputs and {len(outputs)} outputs")
    height, width = _picture_size(pictures[0])
    return Declared(height, width, outputs[0])


def _weight(tensor: memoryview) -> str:
    """The name of a TensorProto that holds its numbers."""
    fields = dict(_fields(tensor))
    if fields.get(14) == EXTERNAL:
        raise ValueError("its weights are in another file, which is not supported")
    return _text(fields.get(8, b""))


def _picture_size(value: memoryview) -> tuple[int | None, int | None]:
    """Height and width of the picture that a ValueInfoProto describes."""
    tensor = dict(_fields(_inner(_inner(value, 2), 1)))
    if tensor.get(1) != FLOAT:
        raise ValueError("it takes no float32 numbers")
    sides = [_side(_message(side)) for number, side in _fields(_message(tensor.get(2, b""))) if number == 1]
    if not sides:  # none is declared
        return None, None
    if len(sides) != 4 or sides[0] not in (1, None) or sides[1] not in (3, None):
        raise ValueError(f"it takes {_times(sides)} numbers, no picture 1 x 3 x H x W")
    height, width = sides[2:]
    if not all(side is None or SIDES[0] <= side <= SIDES[1] for side in (height, width)):
        raise ValueError(f"it takes pictures of {_times([width, height])}, a size out of range")
    return height, width


def _side(dimension: memoryview) -> int | None:
    value = dict(_fields(dimension)).get(1)
    return value if isinstance(value, int) and 0 < value < 1 << 63 else None  # 0 and -1 mean any


def _times(sides: list[int | None]) -> str:
    return " x ".join("?" if side is None else str(side) for side in sides)


def _inner(message: memoryview, number: int) -> memoryview:
    return _message(dict(_fields(message)).get(number, b""))


def _name(message: memoryview) -> str:
    return _text(dict(_fields(message)).get(1, b""))


def _message(value: int | bytes | memoryview) -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number stands in the place of a message")
    return memoryview(value)


def _text(value: int | bytes | memoryview) -> str:
    return str(_message(value), "utf-8")


def _fields(message: memoryview) -> Iterator[tuple[int, int | memoryview]]:
    """Numbers and values of a message's fields: varints as integers, all else as views of its bytes."""
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        kind = key & 7
        if kind == 0:
            value, at = _varint(message, at)
            yield key >> 3, value
            continue
        if kind == 2:
            length, at = _varint(message, at)
        elif kind in (1, 5):
            length = 8 if kind == 1 else 4
        else:
            raise ValueError("it is not protobuf")
        if at + length > len(message):
            raise ValueError("it is cut short")
        yield key >> 3, message[at : at + length]
        at += length


def _varint(message: memoryview, at: int) -> tuple[int, int]:
    """A number in groups of seven bits, lowest first, and where it ends."""
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(message):
            raise ValueError("it is cut short")
        byte = message[at]
        at += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
    raise ValueError("it is not protobuf")
