"""The texture where it was captured: on its base shape, in the scene cube."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mitex.mesh import Similarity
from mitex.methods.nerf import files
from mitex.methods.nerf.field.decoder import Decoder
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.field.rendering import render_step
from mitex.methods.nerf.field.shell import CapturedLatents, Shell
from mitex.methods.nerf.field.tensors import channels
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

DEEPEST = 2.0  # percentile of the scan's distances that counts as the ground


class Captured:
    """What a model file holds, ready to be looked at.

    Attributes:
        model: features, networks, light and base shape.
    """

    def __init__(self, model: files.Model) -> None:
        init(needs="ad")
        self.model = model

    @cached_property
    def shell(self) -> Shell:
        """The texture on the shape that it was captured on, in the scene cube, ready to be marched."""
        model, config = self.model, self.model.config
        projection = Projection(
            model.base.mesh,
            neighbours=config.neighbours,
            repulsion=config.repulsion,
            reach=model.base.thickness,
        )
        return Shell(
            projection,
            self.latents,
            self.decoder,
            self.light,
            model.base.thickness,
            mask=upload(mi.TensorXu8, model.occupied),
            step=render_step(config),
        )

    @cached_property
    def latents(self) -> CapturedLatents:
        """Features on the captured base shape."""
        tables = [upload(mi.Float, table.numpy()) for table in self.model.tables]
        return CapturedLatents(Encoding(self.model.config), tables, self.model.frames)

    @cached_property
    def decoder(self) -> Decoder:
        """The networks, packed."""
        return self.new_decoder()

    def new_decoder(self) -> Decoder:
        """The networks, packed, with matrices of their own, which may change."""
        return Decoder([upload(mi.TensorXf, weight.numpy()) for weight in self.model.weights], packed=True)

    @property
    def light(self) -> mi.TensorXf:
        """`mi.TensorXf` (16,), the light of the capture: estimated from its photos, or learned."""
        return upload(mi.TensorXf, self.model.light.numpy())

    @property
    def similarity(self) -> Similarity:
        """The capture's world -> scene cube."""
        return self.model.similarity

    def features(self, points: np.ndarray) -> np.ndarray:
        """f and f-hat, (N, 24), at points (N, 3) of the base shape."""
        place = channels(mi.Point3f, points)
        encoding, tables = self.latents.encoding, self.latents.tables
        values = [row for k in range(2) for row in encoding(k, place, tables[k])]
        dr.eval(values)  # at once, not in a kernel for each
        return np.stack([np.array(value) for value in values], axis=1)

    def in_place(self) -> Shell:
        """What shows the captured object in the photos' cameras: `shell`."""
        return self.shell

    @cached_property
    def ground(self) -> float:
        """How far the deepest captured parts are from the base shape, negative inside [scene units]."""
        projections = self.shell.projection(self.model.base.scan)
        return float(np.percentile(projections.distance[projections.hit], DEEPEST))
