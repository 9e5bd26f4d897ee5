"""Files that are wrong in one way each, for the robustness table."""

import json
import struct
import zlib
from pathlib import Path

import numpy as np
from PIL import Image

CUBE = """
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8
"""


def fields(folder: Path, normals: np.ndarray) -> None:
    """Files that are no vector fields of a mesh with these normals at its vertices."""
    count = len(normals)
    np.save(folder / "short.npy", np.ones((count - 1, 3)))
    np.save(folder / "nan.npy", np.full((count, 3), np.nan))
    np.save(folder / "zero.npy", np.zeros((count, 3)))
    np.save(folder / "normal.npy", normals)


def image(path: Path, size: tuple[int, int] = (32, 32), kind: str = "PNG", seed: int = 0) -> Path:
    """A noisy RGB image of any file format, whatever the name; size is (width, height)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pixels = np.random.default_rng(seed).integers(0, 256, (size[1], size[0], 3), np.uint8)
    Image.fromarray(pixels).save(path, format=kind)
    return path


def animated(path: Path) -> Path:
    frames = [Image.new("RGB", (32, 32), (value, 0, 0)) for value in (0, 90, 200)]
    frames[0].save(path, save_all=True, append_images=frames[1:])
    return path


def transparent(path: Path) -> Path:
    Image.new("RGBA", (32, 32), (10, 20, 30, 0)).save(path)
    return path


def huge_png(path: Path, side: int = 50_000) -> Path:
    """A file of a few bytes whose header claims `side` x `side` pixels."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"\0" * 99)) + chunk(b"IEND", b"")
    )
    return path


def cut(path: Path, share: float = 0.5) -> Path:
    """The first part of a file, in place."""
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    return path


def text(path: Path, content: str = "hello\n") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content)
    return path


def ply(path: Path, face: str = "3 0 1 2", vertices: str = "0 0 0\n1 0 0\n0 1 0") -> Path:
    """An ASCII PLY of three vertices and one face."""
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    return text(
        path,
        f"{header}element face 1\nproperty list uchar int vertex_indices\nend_header\n{vertices}\n{face}\n",
    )


def foreign_glb(path: Path) -> Path:
    """A valid GLB that Mitex did not write."""
    import trimesh

    trimesh.creation.box().export(path)
    return path


def glb_without_meshes(path: Path) -> Path:
    document = json.dumps({"asset": {"version": "2.0"}}).encode()
    document += b" " * (-len(document) % 4)
    chunk = struct.pack("<I4s", len(document), b"JSON") + document
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk)
    return path


def safetensors(path: Path, **metadata: str) -> Path:
    """A readable safetensors file that holds something else."""
    from safetensors.numpy import save_file

    path.parent.mkdir(parents=True, exist_ok=True)
    save_file({"weight": np.zeros((3, 4), np.float32)}, path, metadata)
    return path


def model(path: Path, hidden: int = 8, cut: int = 0, fill: float = 0.0, condition: int = 0) -> Path:
    """A model file of a cell rule for the albedo; `cut` biases of its first layer are missing."""
    from safetensors.numpy import save_file

    channels = 12
    shapes = {
        "fc1.weight": (hidden, channels * 5 + condition),
        "fc1.bias": (hidden - cut,),
        "fc2.weight": (channels, hidden),
        "fc2.bias": (channels,),
    }
    tensors = {name: np.full(shape, fill, np.float32) for name, shape in shapes.items()}
    about = json.dumps({"name": path.stem, "maps": ["albedo"]})
    save_file(tensors, path, {"format": "mitex-nca-1", "about": about, "degree": "1"})
    return path
