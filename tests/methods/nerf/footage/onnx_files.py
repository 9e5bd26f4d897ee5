"""ONNX files of tiny networks, written by hand as protobuf (onnx.proto of ONNX 1.x names the numbers)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mitex.features.normalisation import MEAN, SPREAD

FLOAT, UINT8 = 1, 2  # element types
Size = Sequence[int | str]  # of a tensor; a text is a size that is free


def redness(
    limit: float = 0.25,
    mean: Sequence[float] = MEAN,
    spread: Sequence[float] = SPREAD,
    steepness: float = 50.0,
    last: str = "Sigmoid",
    size: Size = ("n", 3, "h", "w"),
    second: bool = False,
    kind: int = FLOAT,
    pictures: int = 1,
    masks: int = 1,
    listed: bool = False,
    external: bool = False,
) -> bytes:
    """A network whose mask is where red exceeds blue by more than `limit` (of sRGB in [0, 1]).

    Args:
        limit: where the mask is one half.
        mean, spread: of the colours that it gets, red, green, blue.
        steepness: of what comes before the last operation, in red minus blue.
        last: operation that ends it: "Sigmoid", "Identity" for logits, or any other without attributes.
        size: of the pictures, as declared.
        second: whether the mask's opposite is a further output, computed after it and from it.
        kind: element type of the pictures, as declared.
        pictures, masks: inputs, and channels of the mask.
        listed: whether the weights are listed as inputs as well, as in old files.
        external: whether the weights are said to be in another file.
    """
    red, blue = steepness * spread[0], -steepness * spread[2]
    weights = np.tile(np.array([red, 0.0, blue], np.float32), (masks, 1))
    bias = np.full(masks, steepness * (mean[0] - mean[2] - limit), np.float32)
    nodes = [
        _node("Conv", ["picture0", "weights", "bias"], "score"),
        _node(last, ["score"], "mask"),
    ]
    outputs = ["mask"]
    if second:
        nodes.append(_node("Neg", ["mask"], "opposite"))
        outputs.append("opposite")
    area = (*size[:1], masks, *size[2:])
    return model(
        nodes,
        [_tensor("weights", weights[:, :, None, None], external), _tensor("bias", bias, external)],
        [
            *(_value(name, (masks, 3, 1, 1), FLOAT) for name in ("weights", "bias") if listed),
            *(_value(f"picture{k}", size, kind) for k in range(pictures)),
        ],
        [_value(name, area, FLOAT) for name in outputs],
    )


def model(
    nodes: Sequence[bytes], weights: Sequence[bytes], inputs: Sequence[bytes], outputs: Sequence[bytes]
) -> bytes:
    """A file of a graph, operations of version 11."""
    graph = _message(
        *((1, node) for node in nodes),
        (2, "graph"),
        *((5, tensor) for tensor in weights),
        *((11, value) for value in inputs),
        *((12, value) for value in outputs),
    )
    return _message((1, 6), (2, "tests"), (8, _message((2, 11))), (7, graph))


def write(path: Path, data: bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def _node(operation: str, inputs: Sequence[str], output: str) -> bytes:
    return _message(*((1, name) for name in inputs), (2, output), (3, output), (4, operation))


def _tensor(name: str, values: np.ndarray, external: bool) -> bytes:
    sides = [(1, side) for side in values.shape]
    return _message(*sides, (2, FLOAT), (8, name), (14, 1) if external else (9, values.tobytes()))


def _value(name: str, size: Size, kind: int) -> bytes:
    sides = [_message((2, side) if isinstance(side, str) else (1, side)) for side in size]
    tensor = _message((1, kind), (2, _message(*((1, side) for side in sides))))
    return _message((1, name), (2, _message((1, tensor))))


def _message(*fields: tuple[int, int | str | bytes]) -> bytes:
    """A protobuf message: numbers as varints, all else with its length."""
    data = b""
    for number, value in fields:
        if isinstance(value, int):
            data += _varint(number << 3) + _varint(value)
        else:
            content = value.encode() if isinstance(value, str) else value
            data += _varint(number << 3 | 2) + _varint(len(content)) + content
    return data


def _varint(value: int) -> bytes:
    data = bytearray()
    while value > 127:
        data.append(value & 127 | 128)
        value >>= 7
    return bytes([*data, value])
