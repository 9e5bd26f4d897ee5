"""The loaders of Mitex, each with a valid file to damage."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import torch
from PIL import Image

import mitex
from mitex.asset import Asset
from mitex.batch.plan import Plan
from mitex.cache import cached
from mitex.exemplar import Exemplar
from mitex.images import read_image
from mitex.mesh import Mesh, grid, icosphere
from mitex.mesh.fields import read_vectors
from mitex.methods.baselines.displacement.texture import DisplacementMap
from mitex.methods.baselines.gatys.texture import GatysTexture
from mitex.methods.baselines.multi_view_gram.texture import MultiViewTexture
from mitex.methods.baselines.nerf_tex.config import NerfTexConfig
from mitex.methods.baselines.nerf_tex.networks import network_of
from mitex.methods.baselines.nerf_tex.texture import SETTINGS as BOX_SETTINGS
from mitex.methods.baselines.nerf_tex.texture import NerfTexTexture
from mitex.methods.baselines.plain_field.config import PlainFieldConfig
from mitex.methods.baselines.plain_field.texture import SETTINGS, PlainFieldTexture
from mitex.methods.baselines.quilted.texture import QuiltedTexture
from mitex.methods.baselines.reaction_diffusion.reaction import Reaction
from mitex.methods.baselines.reaction_diffusion.texture import ReactionDiffusionTexture
from mitex.methods.baselines.solid_texture.generator import Generator
from mitex.methods.baselines.solid_texture.texture import SolidTexture
from mitex.methods.baselines.style_mesh.texture import StyleMeshTexture
from mitex.methods.baselines.text2mesh.texture import Text2MeshTexture
from mitex.methods.baselines.x_mesh.texture import XMeshTexture
from mitex.methods.nca.config import PRESETS, NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.weights import graft_weights
from mitex.methods.nerf.capture import visual_hull
from mitex.methods.nerf.capture.capture import load_capture
from mitex.methods.nerf.capture.transforms import read_frames
from mitex.methods.nerf.training.plain import grid_layout
from mitex.methods.relief.texture import ReliefTexture
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.texture import SurfaceTexture
from mitex.runtime import init
from mitex.training import checkpoint, resolve
from mitex.training.config import of_record
from mitex.training.locate import bundled_files
from tests.cli import bad_files
from tests.export.common import wavy
from tests.mesh.examples import (
    FAN_POINTS,
    TETRAHEDRON,
    exported_by_trimesh,
    glb_bytes,
    gltf,
    obj_text,
    ply_bytes,
)
from tests.methods.nerf.capture.ellipsoid import write as write_capture

BALL = icosphere(2)
RESULT = "cache/method/" + "0" * 32  # a cache of its own, which is trimmed to its limit


@dataclass(frozen=True)
class Loader:
    """What reads a file.

    Attributes:
        file: its name.
        write: writes a valid one, with whatever belongs beside it.
        read: reads it.
    """

    file: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]


def _data(data: bytes | str) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(data.encode() if isinstance(data, str) else data)


def _gltf_text() -> str:
    tree, blob = gltf(
        [{"positions": FAN_POINTS, "indices": TETRAHEDRON, "uv": np.float32(FAN_POINTS[:, :2])}]
    )
    uri = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
    return json.dumps(tree | {"buffers": [{"uri": uri, "byteLength": len(blob)}]})


def _picture(path: Path) -> None:
    rng = np.random.default_rng(0)
    Image.fromarray(rng.integers(0, 256, (20, 24, 3), np.uint8)).save(path)


def _normals(path: Path) -> None:
    Image.new("RGB", (20, 24), (128, 127, 250)).save(path)


def _capture(path: Path) -> None:
    pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]
    frames = [{"file_path": f"{k}.png", "transform_matrix": pose} for k in range(3)]
    for frame in frames:
        Image.new("RGBA", (24, 24)).save(path.with_name(str(frame["file_path"])))
    camera = {"fl_x": 30.5, "fl_y": 30.5, "cx": 12, "cy": 12, "w": 24, "h": 24, "k1": 0.01}
    path.write_text(json.dumps({**camera, "frames": frames}))


def _read_capture(path: Path) -> None:
    for frame in read_frames(path):
        frame.intrinsics(24, 24)


def _checkpoint(path: Path) -> None:
    config: dict[str, object] = {"steps": 9, "hidden": 8, "decoder_width": 8}
    look = Look.of(of_record(NcaConfig, config), ["albedo"])
    state = checkpoint.Checkpoint(
        step=5,
        seconds=1.5,
        loss=0.5,
        skipped=0,
        config=config,
        task={f"model.{name}": value for name, value in look.state_dict().items()},
        optimizer={"counts": torch.ones(1)},
        generator=torch.Generator().get_state(),
        metadata={"method": "nca", "maps": "albedo"},
    )
    checkpoint.save(path.parent, state)


def _cached(path: Path) -> Any:
    """The damage must show: what is read is what was written."""

    def write(folder: Path, values: np.ndarray) -> None:
        np.save(folder / "values.npy", values)

    values = cached(path.parent, lambda: np.arange(64), lambda place: np.load(place / "values.npy"), write)
    assert np.array_equal(values, np.arange(64))
    return values


def _surface(path: Path) -> None:
    domain = SurfaceDomain(grid(1, 1), 16, "fixed")
    about = {"name": "a", "resolution": 16, "frames": "fixed", "angle": 0.0}
    SurfaceTexture(domain, np.zeros((len(domain.texels.index), 3), np.float32), ("albedo",), about).save(path)


def _picture_texture(path: Path) -> None:
    GatysTexture(np.full((16, 16, 3), 0.5, np.float32), 64, {"name": "a"}).save(path)


def _nca(path: Path) -> None:
    bad_files.model(path)


def _quilted(path: Path) -> None:
    QuiltedTexture(np.full((8, 8, 3), 0.5, np.float32), 0.1, {"name": "a"}).save(path)


def _multi_view(path: Path) -> None:
    MultiViewTexture(grid(1, 1), np.full((8, 8, 3), 0.5, np.float32), {"name": "a"}).save(path)


def _style_mesh(path: Path) -> None:
    StyleMeshTexture(grid(1, 1), np.full((8, 8, 3), 0.5, np.float32), {"name": "a"}).save(path)


def _text2mesh(path: Path) -> None:
    Text2MeshTexture(grid(1, 1), np.full((8, 8, 3), 0.5, np.float32), {"name": "a"}).save(path)


def _relief(path: Path) -> None:
    maps = {"albedo": np.full((8, 8, 3), 0.5, np.float32), "roughness": np.full((8, 8, 1), 0.5, np.float32)}
    ReliefTexture(grid(1, 1), grid(2, 2), grid(2, 2), maps, {"name": "a"}).save(path)


def _x_mesh(path: Path) -> None:
    image = np.full((8, 8, 3), 0.5, np.float32)
    XMeshTexture(grid(1, 1), image, {"name": "a"}, grid(2, 2)).save(path)


def _nerf(path: Path) -> None:
    from tests.methods.nerf.small import small_texture

    small_texture().save(path)


def _plain_field(path: Path) -> None:
    init()
    config = PlainFieldConfig(table=8, occupancy=16)
    about = {key: getattr(config, key) for key in SETTINGS} | {"name": "a", "centre": [0.0] * 3, "scale": 1.0}
    parameters = {name: torch.zeros(shape) for name, shape in grid_layout(config).shapes.items()}
    PlainFieldTexture(parameters, np.ones((16, 16, 16), np.uint8), about).save(path)


def _nerf_tex(path: Path) -> None:
    init()
    config = NerfTexConfig(table=8, occupancy=16)
    about = {key: getattr(config, key) for key in BOX_SETTINGS}
    about |= {"name": "a", "half": 0.2, "ground": -0.1, "light": [0.0, 0.0, 1.0]}
    parameters = {name: torch.zeros(shape) for name, shape in network_of(config).shapes.items()}
    NerfTexTexture(parameters, np.ones((16, 16, 16), np.uint8), about).save(path)


def _reaction_diffusion(path: Path) -> None:
    reaction = Reaction.random(3, 4, torch.full((3,), 0.1), torch.Generator().manual_seed(0))
    ReactionDiffusionTexture(reaction, 16, 0.5, {"name": "a"}).save(path)


def _solid(path: Path) -> None:
    SolidTexture(Generator.random(torch.Generator().manual_seed(0)), 16, 0.5, {"name": "a"}).save(path)


def _photos(path: Path) -> None:
    write_capture(path.parents[1], 8)


def _read_photos(path: Path) -> None:
    with mock.patch.object(visual_hull, "RESOLUTION", 16):  # most of the time is spent on it
        load_capture(path.parents[1])


CONFIG = 'preset = "patch"\nsteps = 20\nhidden = 8\nlr = 1e-3\nmilestones = [5, 9]\n[run]\nmethod = "nca"\n'
PLAN = """exemplars = ["lava"]
meshes = ["knot"]
seeds = [1, 2]
[methods.nca]
steps = 5
[methods.nca.apply]
scale = 2.0
"""
STROKES = json.dumps({"strokes": [[[0, 0, 1], [0.5, 0, 0.8]], [[0, 1, 0], [0.1, 0.9, 0.2]]]})
SMALL = wavy(icosphere(1))
VALUES = np.c_[BALL.vertices, BALL.vertices[:, :1] * 0.5 + 0.5]

LOADERS = {
    "obj": Loader(
        "a.obj", _data(obj_text(BALL) + "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 -1/1/1 -2/1/1\n"), Mesh.load
    ),
    "ply": Loader("a.ply", _data(ply_bytes(FAN_POINTS, [[0, 1, 2, 3], [0, 1, 2]])), Mesh.load),
    "ply text": Loader("a.ply", _data(exported_by_trimesh(BALL, "ply", encoding="ascii")), Mesh.load),
    "stl": Loader("a.stl", _data(exported_by_trimesh(icosphere(1), "stl")), Mesh.load),
    "stl text": Loader("a.stl", _data(exported_by_trimesh(icosphere(1), "stl_ascii")), Mesh.load),
    "off": Loader("a.off", _data(exported_by_trimesh(icosphere(1), "off")), Mesh.load),
    "gltf": Loader("a.gltf", _data(_gltf_text()), Mesh.load),
    "glb": Loader(
        "a.glb", _data(glb_bytes(*gltf([{"positions": FAN_POINTS, "indices": TETRAHEDRON}]))), Mesh.load
    ),
    "png": Loader("a.png", _picture, read_image),
    "jpeg": Loader("a.jpg", _picture, Exemplar.load),
    "maps": Loader("maps/normal.png", _normals, lambda path: Exemplar.load(path.parent)),
    "nca": Loader("a.safetensors", _nca, mitex.load),
    "nca with a decoder": Loader("a.safetensors", _data(bundled_files()["lava"].read_bytes()), mitex.load),
    "geometric": Loader("a.safetensors", _data(bundled_files()["spikes"].read_bytes()), mitex.load),
    "surface": Loader("a.safetensors", _surface, mitex.load),
    "nerf": Loader("a.safetensors", _nerf, mitex.load),
    "displacement": Loader(
        "a.safetensors", DisplacementMap(np.zeros((8, 8)), 0.2, {"name": "a"}).save, mitex.load
    ),
    "gatys": Loader("a.safetensors", _picture_texture, mitex.load),
    "quilted": Loader("a.safetensors", _quilted, mitex.load),
    "nerf_tex": Loader("a.safetensors", _nerf_tex, mitex.load),
    "plain_field": Loader("a.safetensors", _plain_field, mitex.load),
    "reaction_diffusion": Loader("a.safetensors", _reaction_diffusion, mitex.load),
    "solid_texture": Loader("a.safetensors", _solid, mitex.load),
    "style_mesh": Loader("a.safetensors", _style_mesh, mitex.load),
    "text2mesh": Loader("a.safetensors", _text2mesh, mitex.load),
    "relief": Loader("a.safetensors", _relief, mitex.load),
    "x_mesh": Loader("a.safetensors", _x_mesh, mitex.load),
    "multi_view_gram": Loader("a.safetensors", _multi_view, mitex.load),
    "checkpoint": Loader("checkpoint.safetensors", _checkpoint, lambda path: checkpoint.load(path.parent)),
    "checkpoint as a texture": Loader(
        "checkpoint.safetensors", _checkpoint, lambda path: mitex.load(path.parent)
    ),
    "config": Loader("c.toml", _data(CONFIG), partial(resolve, PRESETS, None)),
    "plan": Loader("plan.toml", _data(PLAN), Plan.read),
    "capture": Loader("transforms.json", _capture, _read_capture),
    "photo": Loader("photos/images/000.png", _photos, _read_photos),
    "cache": Loader(RESULT + "/values.npy", _cached, _cached),
    "manifest": Loader(RESULT + "/manifest.json", _cached, _cached),
    "asset glb": Loader("a.glb", SMALL.export, Asset.load),
    "baked glb": Loader("a.glb", SMALL.baked(16).export, Asset.load),
    "asset ply": Loader("a.ply", SMALL.export, Asset.load),
    "asset obj": Loader("a.obj", SMALL.baked(16).export, Asset.load),
    "material": Loader(
        "a.mtl",
        lambda path: SMALL.baked(16).export(path.with_suffix(".obj")),
        lambda path: Asset.load(path.with_suffix(".obj")),
    ),
    "npy": Loader("a.npy", lambda path: np.save(path, BALL.vertices), partial(read_vectors, BALL)),
    "field ply": Loader(
        "a.ply",
        _data(ply_bytes(np.c_[BALL.vertices, BALL.vertices], [], columns=("x", "y", "z", "vx", "vy", "vz"))),
        partial(read_vectors, BALL),
    ),
    "strokes": Loader("a.json", _data(STROKES), partial(read_vectors, BALL)),
    "weights": Loader(
        "a.ply", _data(ply_bytes(VALUES, [], columns=("x", "y", "z", "weight"))), partial(graft_weights, BALL)
    ),
}
