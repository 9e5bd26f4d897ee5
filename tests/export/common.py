"""An asset with every map, files of others, and readers of GLB and EXR that share no code with Mitex."""

import io
import json
import struct
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

from mitex.asset import Asset
from mitex.geometry.vectors import orthonormal
from mitex.mesh import Mesh, icosphere


def read_exr(path: Path) -> dict[str, np.ndarray]:
    """The channels of an EXR file, name -> (H, W)."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def wavy(mesh: Mesh | None = None, name: str = "wavy", without: tuple[str, ...] = ()) -> Asset:
    """Smooth maps of all five kinds on a sphere; normals lean up to 30 degrees."""
    mesh = mesh or icosphere(10)
    p = mesh.vertices
    wave = [0.5 + 0.4 * np.sin(4 * p[:, k] + k) for k in range(3)]
    lean = np.stack([0.4 * np.sin(5 * p[:, 0]), 0.4 * np.cos(4 * p[:, 1]), np.full(len(p), 0.8)], axis=1)
    lean /= np.linalg.norm(lean, axis=1, keepdims=True)
    maps = {
        "albedo": np.stack(wave, axis=1),
        "ambient_occlusion": 1.0 - 0.3 * wave[2][:, None],
        "height": wave[0][:, None],
        "normal": 0.5 + 0.5 * lean,
        "roughness": wave[1][:, None],
    }
    tangents = orthonormal(np.tile(np.array([0.3, 0.1, 1.0]), (len(p), 1)), mesh.normals)
    return Asset(mesh, {k: v for k, v in maps.items() if k not in without}, tangents, name=name)


def write_foreign(file: Path, content: str, text: str) -> None:
    """A file that Mitex did not write: an "image", a "link" to nowhere, or else the text."""
    if content == "image":
        Image.new("RGB", (4, 4)).save(file, "PNG")
    elif content == "link":
        file.symlink_to("nowhere")
    else:
        file.write_text(text)


class Glb:
    """A GLB file, read by the letter of the glTF 2.0 specification."""

    def __init__(self, path: Path):
        data = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.document = json.loads(data[20 : 20 + size])
        binary, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0" and binary % 4 == 0 and 28 + size + binary == length
        self.blob = data[28 + size :]
        self.primitive = self.document["meshes"][0]["primitives"][0]
        self.material = self.document["materials"][self.primitive["material"]]

    def view(self, index: int) -> bytes:
        entry = self.document["bufferViews"][index]
        return self.blob[entry["byteOffset"] : entry["byteOffset"] + entry["byteLength"]]

    def accessor(self, index: int) -> np.ndarray:
        entry = self.document["accessors"][index]
        dtype = {5126: np.float32, 5125: np.uint32}[entry["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[entry["type"]]
        values = np.frombuffer(self.view(entry["bufferView"]), dtype).reshape(-1, width)
        assert len(values) == entry["count"]
        if "min" in entry:
            np.testing.assert_array_equal(values.min(axis=0), np.float32(entry["min"]))
            np.testing.assert_array_equal(values.max(axis=0), np.float32(entry["max"]))
        return values

    def attribute(self, name: str) -> np.ndarray:
        return self.accessor(self.primitive["attributes"][name])

    @property
    def faces(self) -> np.ndarray:
        return self.accessor(self.primitive["indices"]).reshape(-1, 3)

    def image(self, reference: dict) -> np.ndarray:
        entry = self.document["images"][self.document["textures"][reference["index"]]["source"]]
        assert entry["mimeType"] == "image/png"
        return np.asarray(Image.open(io.BytesIO(self.view(entry["bufferView"]))))
