"""A grown state as textures of Mitsuba scenes: what is decoded at the vertices is what `apply` has there."""

import numpy as np
import pytest
import torch

from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.scenes.shapes import mesh_shape
from tests.textures.helpers import interaction

MAPS = ("albedo", "height", "roughness")


@pytest.mark.parametrize("decoder", [True, False])
def test_maps_are_those_of_apply(mi, decoder: bool):
    mesh = icosphere(4)
    look = Look.of(NcaConfig(decoder=decoder, hidden=16), MAPS)
    look.initialise(torch.Generator().manual_seed(0), 0.5)
    texture = NcaTexture(look)
    maps = texture.fields(mesh, seed=3, steps=12)
    asset = texture.apply(mesh, seed=3, steps=12, subdivide=0, resolution=None)
    assert tuple(maps) == MAPS
    assert maps["albedo"]["type"] == ("decoded_field" if decoder else "vertex_field")
    shape = mesh_shape(mesh)
    vertex = mesh.faces[:, 0]
    corner = np.broadcast_to([1, 0, 0], (len(vertex), 3))
    si = interaction(mi, shape, np.arange(len(vertex)), corner)
    for name, properties in maps.items():
        field = mi.load_dict(properties)
        values = np.array(field.eval_3(si)).T if name == "albedo" else field.eval_1(si).numpy()[:, None]
        np.testing.assert_allclose(values.clip(0, 1), asset.vertex_maps[name][vertex], atol=1e-5)
        assert values.std() > 1e-3
