"""Real textures as scene objects: parameters are listed, can be set, and get derivatives of images."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.field.networks import LAYERS
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from tests.methods.nerf.small import small_maps, small_texture
from tests.scenes.helpers import shell_scene

init()

MATRICES = {f"weights.{name}.{k}" for name, widths in LAYERS.items() for k in range(len(widths) - 1)}
SEED, SPP = 3, 4


def applied():
    return small_texture().apply(icosphere(4), small_maps(), density=4.0)


def captured():
    return small_texture().shell


FIELDS = {
    "applied": (applied, {"features", "light"} | MATRICES),
    "captured": (captured, {"tables.f", "tables.phase", "light"} | MATRICES),
}


def scene_of(field):
    return shell_scene(field, fov=32, side=6, sky={"type": "constant", "radiance": 0.5})


def parameter(scene, name):
    """The scene's parameters, and the key of one of the field's."""
    params = mi.traverse(scene)
    return params, next(key for key in params.keys() if key.endswith(f"field.{name}"))  # noqa: SIM118


def picture(scene):
    return np.array(mi.render(scene, spp=SPP, seed=SEED)).astype(np.float64)


@pytest.mark.parametrize("name", FIELDS)
def test_all_that_was_learned_is_listed(name):
    make, expected = FIELDS[name]
    keys = [key for key in mi.traverse(scene_of(make())).keys() if ".field." in key]  # noqa: SIM118
    assert {key.split(".field.")[1] for key in keys} == expected


@pytest.mark.parametrize(
    ("field", "name"),
    [
        ("applied", "features"),
        ("applied", "light"),
        ("applied", "weights.density.0"),
        ("applied", "weights.reflection.1"),
        ("applied", "weights.theta.2"),
        ("applied", "weights.phi.0"),
        ("captured", "tables.f"),
        ("captured", "tables.phase"),
        ("captured", "weights.density.1"),
    ],
)
def test_gradients_are_those_of_finite_differences(field, name):
    """Along a random direction in the parameter, of a random weighting of the image's pixels."""
    scene = scene_of(FIELDS[field][0]())
    params, key = parameter(scene, name)
    value, rng = np.array(params[key]), np.random.default_rng(0)
    pixels = rng.normal(size=(6, 6, 3)).astype(np.float32)
    along = rng.normal(size=value.shape).astype(np.float32)

    dr.enable_grad(params[key])
    params.update()
    image = scene.integrator().render(scene, scene.sensors()[0], seed=SEED, spp=SPP)
    dr.backward(dr.sum(image * mi.TensorXf(pixels), axis=None))
    gradient = np.array(dr.grad(params[key]))
    assert np.isfinite(gradient).all() and np.abs(gradient).max() > 0
    dr.disable_grad(params[key])

    # As large as float32 images ask for, as small as the ReLUs allow.
    step = 5e-4 * np.abs(value).max()
    totals = []
    for sign in (1, -1):
        array: Any = type(params[key])
        params[key] = array(value + sign * step * along)
        params.update()
        totals.append((picture(scene) * pixels).sum())
    slope = (totals[0] - totals[1]) / (2 * step)
    # The scalar product with a random direction has the gradient's length for a standard deviation.
    assert abs((gradient * along).sum() - slope) < 2e-2 * np.linalg.norm(gradient)


def test_mi_render_has_the_same_gradient():
    """Through Mitsuba's own operation, whose adjoint is rendered with other random numbers."""
    scene = scene_of(applied())
    params, key = parameter(scene, "light")
    gradients = []
    for render in (
        lambda: mi.render(scene, params, spp=256, seed=1),
        lambda: scene.integrator().render(scene, scene.sensors()[0], seed=7, spp=256),
    ):
        dr.enable_grad(params[key])
        params.update()
        dr.backward(dr.sum(render(), axis=None))
        gradients.append(np.array(dr.grad(params[key])))
        dr.disable_grad(params[key])
    np.testing.assert_allclose(*gradients, atol=3e-2 * np.abs(gradients[0]).max())


@pytest.mark.parametrize("name", ["light", "features", "weights.density.1", "weights.reflection.2"])
def test_new_values_are_rendered(name):
    """As of a texture that had them from the start, and no other texture changes with it."""
    texture, maps = small_texture(), small_maps()
    first, other = (texture.apply(icosphere(4), maps, density=4.0) for _ in range(2))
    scene, second = scene_of(first), scene_of(other)
    before = picture(scene)
    params, key = parameter(scene, name)
    value = 0.5 * np.array(params[key])
    params[key] = mi.TensorXf(value)
    params.update()
    after = picture(scene)
    assert np.abs(after - before).max() > 1e-2
    np.testing.assert_allclose(picture(second), before, atol=1e-5)  # sums in another order

    fresh = with_value(name, value)
    fresh.mask = first.mask
    np.testing.assert_allclose(picture(scene_of(fresh)), after, atol=1e-5)


def with_value(name: str, value: np.ndarray):
    """The texture made with another value of a parameter."""
    texture, maps = small_texture(), small_maps()
    if name == "features":
        maps = replace(maps, features=value)
    elif name.startswith("weights."):
        index = list(texture.decoder.parameters).index(name.removeprefix("weights."))
        texture.model.weights[index] = torch.from_numpy(value)
        texture = NerfTexture(texture.model)
    light = value if name == "light" else None
    return texture.apply(icosphere(4), maps, density=4.0, light=light)


def test_values_of_another_shape_are_refused():
    scene = scene_of(applied())
    params, key = parameter(scene, "weights.density.0")
    params[key] = upload(mi.TensorXf, np.zeros((3, 3), np.float32))
    with pytest.raises(ConfigError, match=r"weights\.density\.0"):
        params.update()
