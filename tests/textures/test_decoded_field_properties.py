"""decoded_field: what it says of itself, what it refuses, and variants."""

import numpy as np
import pytest

from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.runtime.upload import upload
from tests.textures.decoded import EVERY, UNEVEN, constant, properties, random_look, values
from tests.textures.helpers import quad, radiance


def test_mean_and_max_go_over_the_vertices(mi):
    look = random_look("smooth", EVERY)
    texture = mi.load_dict(properties(look))
    corner = [(face, k) for v in range(60) for face, k in [np.argwhere(UNEVEN.faces == v)[0]]]
    face, k = np.array(corner).T
    colours = srgb_to_linear(values(mi, texture, UNEVEN, face, np.eye(3)[k])[:, :3].clip(0, 1))
    assert texture.mean()[0] == pytest.approx(colours.mean(), rel=1e-4)
    assert texture.max() == pytest.approx(colours.max(), rel=1e-4)
    assert texture.is_spatially_varying()


def test_to_string(mi):
    text = str(mi.load_dict(properties(random_look("linear", ("waves", "polynomials")))))
    assert text.startswith("DecodedField[\n  vertices = 60,\n  states = 12,\n  channels = 7,\n")
    assert "interpolation = linear,\n  coordinates = waves polynomials,\n  channel = 0" in text


def tensor(*shape: int, value: float = 0.0):
    return lambda mi: upload(mi.TensorXf, np.full(shape, value, np.float32))


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"chanel": 1}, "chanel"),
        ({"channel": 3}, "use 0 to 2"),
        ({"channel": -1}, "use 0 to 2"),
        ({"data": None}, "data"),
        ({"data": tensor(3, 3)}, r"'data' has shape \(3, 3\); give one of shape \(4, C\)"),
        ({"data": tensor(4, 0)}, "'data' has shape"),
        ({"data": tensor(4)}, "'data' has shape"),
        ({"data": tensor(4, 2)}, "3 inputs, but state and coordinates are 2"),
        ({"coordinates": "polynomials"}, "3 inputs, but state and coordinates are 5"),
        ({"coordinates": "waves"}, "waves"),
        ({"coordinates": "waves", "waves": tensor(2, 3)}, r"'waves' has shape \(2, 3\)"),
        ({"coordinates": "wave"}, "'wave'; use some of waves, barycentrics, polynomials"),
        ({"interpolation": "cubic"}, "'cubic'; use smooth or linear"),
        ({"vertices": None}, "vertices"),
        ({"vertices": tensor(4, 2)}, "the mesh at rest"),
        ({"vertices": tensor(4, 3, value=np.nan)}, "the mesh at rest"),
        ({"faces": tensor(2, 3, value=4)}, "the mesh at rest"),
        ({"faces": tensor(2, 3, value=0.5)}, "the mesh at rest"),
        ({"faces": tensor(2, 3, value=np.nan)}, "the mesh at rest"),
        ({"faces": tensor(2, 4)}, "the mesh at rest"),
        ({"weight_0": None}, "pairs"),
        ({"bias_0": None}, "bias_0"),
        ({"weight_0": tensor(3)}, r"'weight_0' has shape \(3,\)"),
        ({"weight_0": tensor(0, 3)}, r"'weight_0' has shape \(0, 3\)"),
        ({"bias_0": tensor(2)}, r"'bias_0' has shape \(2,\); give \(3,\)"),
        ({"weight_1": tensor(3, 4), "bias_1": tensor(3)}, "has 4 inputs, but the layer before gives 3"),
    ],
)
def test_bad_properties_are_refused(mi, options: dict, problem: str):
    options = {name: value(mi) if callable(value) else value for name, value in options.items()}
    plugin = constant(mi, [0.0] * 3) | options
    with pytest.raises(RuntimeError, match=problem):
        mi.load_dict({name: value for name, value in plugin.items() if value is not None})


@pytest.mark.parametrize(("name", "shape"), [("data", (5, 3)), ("weight_0", (3, 2)), ("bias_0", (4,))])
def test_bad_updates_are_refused(mi, name: str, shape: tuple[int, ...]):
    params = mi.traverse(mi.load_dict(constant(mi, [0.0] * 3)))
    params[name] = upload(mi.TensorXf, np.zeros(shape, np.float32))
    with pytest.raises(ConfigError, match=name):
        params.update()


def test_other_shapes_read_nothing(mi):
    field = constant(mi, [0.5] * 3, raw=True, offset=0.1)
    ball = mi.load_dict({"type": "sphere", "radius": 2.0, "bsdf": {"type": "diffuse", "reflectance": field}})
    scene = mi.load_dict({"type": "scene", "ball": ball})
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0.1, 0.2, 3), mi.Vector3f(0, 0, -1)))
    np.testing.assert_allclose(si.bsdf().eval_diffuse_reflectance(si)[0].numpy(), 0.1, atol=1e-6)


def test_other_variants(mi, points):
    """Mono shows luminance; scalar is refused."""
    before = mi.variant()
    try:
        mi.set_variant("llvm_ad_mono")
        texture = constant(mi, [0.2, 0.5, 0.7], raw=True)
        value = radiance(mi, quad(mi, {"type": "diffuse", "reflectance": texture}), *points)
        np.testing.assert_allclose(value, 0.2 * 0.212671 + 0.5 * 0.715160 + 0.7 * 0.072169, atol=1e-5)
        mi.set_variant("scalar_rgb")
        with pytest.raises(RuntimeError, match="llvm"):
            mi.load_dict(constant(mi, [0.0] * 3))
    finally:
        mi.set_variant(before)
