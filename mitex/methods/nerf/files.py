"""Model files: features, networks and light of a texture, and the base shape that they were learned on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.mesh import Mesh, Similarity
from mitex.methods.nerf import METHOD
from mitex.methods.nerf.base.coarse import BaseShape
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.lighting import COEFFICIENTS
from mitex.methods.nerf.field.networks import MATRICES, weight_shapes
from mitex.methods.nerf.field.occupancy import packed_cells, unpacked_cells
from mitex.runtime import init
from mitex.training import model_file
from mitex.training.config import of_record

SETTINGS = (  # that the model depends on
    "table",
    "coarsest",
    "finest",
    "density_width",
    "fresnel",
    "ray_steps",
    "occupancy",
    "repulsion",
    "neighbours",
)


@dataclass
class Model:
    """What is stored.

    Attributes:
        base: base shape, scan and thickness.
        frames: (F, 3, 3) rows t, b, n of its faces.
        tables: of f and f-hat, flat.
        weights: matrices of the networks, as of `networks.weight_shapes`.
        light: (16,) spherical harmonics.
        occupied: (G, G, G) uint8, cells of the scene cube with matter.
        about: JSON values: name, preset, steps, `SETTINGS`, and how the capture was placed.
    """

    base: BaseShape
    frames: np.ndarray
    tables: list[torch.Tensor]
    weights: list[torch.Tensor]
    light: torch.Tensor
    occupied: np.ndarray
    about: dict[str, Any]

    @property
    def similarity(self) -> Similarity:
        """The capture's world -> scene cube."""
        return Similarity.of_record(self.about)

    @property
    def config(self) -> NerfConfig:
        """As far as the model depends on it."""
        return of_record(NerfConfig, {key: self.about[key] for key in SETTINGS})


def save(path: Path, model: Model) -> Path:
    """Writes a model.

    Raises:
        OutputError: the place is not writable.
    """
    base = model.base
    tensors = {
        "vertices": torch.tensor(base.mesh.vertices),
        "faces": torch.tensor(base.mesh.faces),
        "scan": torch.from_numpy(base.scan),
        "frames": torch.from_numpy(model.frames),
        "tables/f": model.tables[0],
        "tables/phase": model.tables[1],
        "light": model.light,
        "occupied": packed_cells(model.occupied),
    }
    tensors |= {f"weights/{k}": value for k, value in enumerate(model.weights)}
    return model_file.save(path, tensors, METHOD.name, model.about | {"thickness": base.thickness})


def load(source: str | Path) -> Model:
    """Reads a model by file or run folder.

    Raises:
        CheckpointError: there is none, or it is damaged.
    """
    init(needs="ad")
    with model_file.opened(source, METHOD.name) as (tensors, about):
        if not all(tensor.isfinite().all() for tensor in tensors.values()):
            raise ValueError("values that are not finite")
        mesh = Mesh(tensors["vertices"].numpy(), tensors["faces"].numpy(), name=f"{about['name']} base")
        base = BaseShape(mesh, tensors["scan"].numpy(), float(about["thickness"]))
        weights = [tensors[f"weights/{k}"] for k in range(MATRICES)]
        tables = [tensors["tables/f"], tensors["tables/phase"]]
        occupied = unpacked_cells(tensors["occupied"], int(about["occupancy"]))
        model = Model(base, tensors["frames"].numpy(), tables, weights, tensors["light"], occupied, about)
        _check(model)
        return model


def _check(model: Model) -> None:
    shapes: Mapping[str, tuple[object, object]] = {
        "weights": ([tuple(w.shape) for w in model.weights], weight_shapes(model.config)),
        "tables": ([len(t) for t in model.tables], Encoding(model.config).sizes),
        "frames": (model.frames.shape, (len(model.base.mesh.faces), 3, 3)),
        "light": (tuple(model.light.shape), (COEFFICIENTS,)),
    }
    model.similarity  # noqa: B018  (raises where its numbers are none)
    for name, (shape, expected) in shapes.items():
        if shape != expected:
            raise ValueError(f"{name} of another shape")
