"""decoded_fields of the tests: random looks and states, on an uneven sphere and on the quad."""

import numpy as np
import torch
from torch import nn

from mitex.mesh import Mesh, scattered_sphere
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.decoder.surface import Points
from mitex.methods.nca.field import fields
from mitex.methods.nca.look import Look
from mitex.runtime.upload import upload
from mitex.scenes.shapes import mesh_shape
from mitex.textures.interpolation import Kind
from tests.textures.helpers import FACES, QUAD, interaction

CHANNELS = 12  # of states: the fewer, the sooner a kernel is compiled
MAPS = ("albedo", "height", "normal")  # 7 channels; height is number 3
EVERY = ("waves", "barycentrics", "polynomials")
CASES: list[tuple[Kind, tuple[str, ...]]] = [
    ("smooth", EVERY),
    ("smooth", ("polynomials", "waves")),
    ("linear", ("waves",)),
    ("linear", ()),
]
UNEVEN = scattered_sphere(60)


def random_look(
    interpolation: Kind = "smooth", coordinates: tuple[str, ...] = (), seed: int = 0, depth: int = 3
) -> Look:
    config = NcaConfig(
        channels=CHANNELS,
        interpolation=interpolation,
        coordinates=coordinates,
        decoder_width=8,
        decoder_depth=depth,
    )
    look = Look.of(config, MAPS)
    look.initialise(torch.Generator().manual_seed(seed), 0.5)
    return look


def layers(look: Look) -> list[nn.Linear]:
    assert isinstance(look.decoder, Decoder)
    return look.decoder.network.linear


def random_state(mesh: Mesh) -> torch.Tensor:
    return 0.4 * torch.randn(len(mesh.vertices), CHANNELS, generator=torch.Generator().manual_seed(1))


def random_points(mesh: Mesh, count: int = 200) -> Points:
    rng = np.random.default_rng(2)
    face = torch.from_numpy(rng.integers(0, len(mesh.faces), count).astype(np.int32))
    return Points(face, torch.from_numpy(rng.dirichlet((1, 1, 1), count).astype(np.float32)))


def properties(
    look: Look, mesh: Mesh = UNEVEN, state: torch.Tensor | None = None, name: str = "albedo"
) -> dict:
    return fields(look, random_state(mesh) if state is None else state, mesh)[name]


def values(mi, texture, mesh: Mesh, face, barycentric) -> np.ndarray:
    """(P, K) values of all channels."""
    from mitex.runtime.jit import dr

    shape = mesh_shape(mesh)
    si = interaction(mi, shape, np.asarray(face), np.asarray(barycentric))
    channels = texture.gather(texture.locate(si))
    dr.eval(channels)  # in one kernel, which takes most of the time
    return np.array(channels).T


def constant(mi, value: list[float], data: np.ndarray | None = None, **options) -> dict:
    """On the quad: one linear layer, of the states (4, 3) if given, plus a constant."""
    weight = np.zeros((len(value), 3)) if data is None else np.eye(3)
    tensors = {
        "data": np.zeros((4, 3)) if data is None else data,
        "vertices": QUAD,
        "faces": FACES,
        "weight_0": weight,
        "bias_0": np.array(value),
    }
    tensors = {name: upload(mi.TensorXf, np.asarray(tensor, np.float32)) for name, tensor in tensors.items()}
    return {"type": "decoded_field"} | tensors | options
