"""Shading against integrals over the sphere, harmonics from SciPy, and finite differences."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import eval_legendre, sph_harm_y

from mitex.errors import ImageError
from mitex.methods.nerf.field.lighting import (
    BANDS,
    COEFFICIENTS,
    COSINE,
    TOE,
    project_environment,
    rotated,
    shade,
    to_display,
)
from mitex.runtime.upload import upload

RENDERED = BANDS**2  # coefficients


def _harmonics(directions: np.ndarray, bands: int = 4) -> np.ndarray:
    """Real harmonics (N, bands^2) of unit vectors (N, 3), with the Condon-Shortley phase."""
    polar, azimuth = np.arccos(directions[:, 2].clip(-1, 1)), np.arctan2(directions[:, 1], directions[:, 0])
    columns = []
    for degree in range(bands):
        for order in range(-degree, degree + 1):
            y = sph_harm_y(degree, abs(order), polar, azimuth)
            columns.append(y.real if order == 0 else math.sqrt(2) * (y.real if order > 0 else y.imag))
    return np.stack(columns, axis=1)


def _sphere(count: int = 64) -> tuple[np.ndarray, np.ndarray]:
    """A quadrature: directions (N, 3) and weights (N,) that sum to 4 pi, exact for l < count."""
    z, weights = np.polynomial.legendre.leggauss(count)
    azimuth = np.arange(2 * count) * (math.pi / count)
    radius = np.sqrt(1 - z * z)[:, None]
    axes = (
        radius * np.cos(azimuth),
        radius * np.sin(azimuth),
        np.broadcast_to(z[:, None], (count, 2 * count)),
    )
    return np.stack([a.ravel() for a in axes], axis=1), np.repeat(weights, 2 * count) * (math.pi / count)


@pytest.fixture
def unit(rng):
    def draw(count):
        vectors = rng.normal(size=(count, 3))
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)

    return draw


@pytest.fixture
def bright(rng):
    """A light of l <= 2 in three channels (16, 3) that is positive everywhere, also when rendered."""
    light = np.zeros((COEFFICIENTS, 3))
    light[:9] = rng.uniform(-0.3, 0.3, (9, 3))
    light[0] = 4.0
    return light


def _shade(mi, normals, light, *, view=None, kd: Any = 0.0, ks=0.0, glossiness=1.0):
    """`shade` from arrays and back: (N, 3)."""
    view = -normals if view is None else view
    n, v = (mi.Vector3f(np.ascontiguousarray(x.T, np.float32)) for x in (normals, view))
    light = upload(mi.TensorXf, np.asarray(light, np.float32))
    radiance = shade(n, v, mi.Color3f(kd), mi.Float(ks), mi.Float(glossiness), light)
    return np.broadcast_to(np.array(radiance).T, normals.shape)


def _mirrored(view, normals):
    return view - 2 * (view * normals).sum(1, keepdims=True) * normals


def _alone(index):
    light = np.zeros(COEFFICIENTS)
    light[index] = 1.0
    return light


def test_the_reference_harmonics_are_orthonormal_over_the_quadrature():
    directions, weights = _sphere()
    basis = _harmonics(directions)
    np.testing.assert_allclose(basis.T @ (weights[:, None] * basis), np.eye(16), atol=1e-12)


def test_basis_is_the_reference_and_orthonormal(mi, unit):
    """Each coefficient alone, seen in a perfect mirror: + and - give both signs past the clamp at 0."""
    directions, weights = _sphere(8)
    columns = []
    for index in range(RENDERED):
        lights = (_alone(index), -_alone(index))
        plus, minus = (_shade(mi, directions, light, ks=1.0, glossiness=1e9)[:, 0] for light in lights)
        columns.append(plus - minus)
    basis = np.stack(columns, axis=1)
    np.testing.assert_allclose(basis, _harmonics(directions)[:, :RENDERED], atol=2e-6)
    np.testing.assert_allclose(basis.T @ (weights[:, None] * basis), np.eye(RENDERED), atol=2e-5)


@pytest.mark.parametrize(
    ("index", "direction", "value"),
    [
        (0, (0, 0, 1), math.sqrt(1 / (4 * math.pi))),
        (1, (0, -1, 0), math.sqrt(3 / (4 * math.pi))),
        (2, (0, 0, 1), math.sqrt(3 / (4 * math.pi))),
        (3, (-1, 0, 0), math.sqrt(3 / (4 * math.pi))),
        (4, (0.6, 0.8, 0), math.sqrt(15 / (4 * math.pi)) * 0.48),
        (5, (0, -0.6, 0.8), math.sqrt(15 / (4 * math.pi)) * 0.48),
        (6, (0, 0, 1), math.sqrt(5 / (16 * math.pi)) * 2),
        (7, (-0.6, 0, 0.8), math.sqrt(15 / (4 * math.pi)) * 0.48),
        (8, (0.8, 0.6, 0), math.sqrt(15 / (16 * math.pi)) * 0.28),
    ],
)
def test_signs_are_those_of_the_docstring(mi, index, direction, value):
    radiance = _shade(mi, np.array([direction], float), _alone(index), ks=1.0, glossiness=1e9)
    assert radiance[0, 0] == pytest.approx(value, rel=1e-5)


def test_diffuse_is_the_integral_of_light_times_cosine(mi, unit, bright):
    normals, kd = unit(20), [0.9, 0.5, 0.2]
    directions, weights = _sphere(200)
    arriving = _harmonics(directions) @ bright
    cosine = (normals @ directions.T).clip(0) / math.pi
    expected = np.array(kd) * ((cosine * weights) @ arriving)
    np.testing.assert_allclose(_shade(mi, normals, bright, kd=kd), expected, rtol=3e-4)


def test_cosine_coefficients_are_those_of_the_lobe():
    """2 pi int max(z, 0) / pi P_l(z) dz."""
    z, weights = np.polynomial.legendre.leggauss(20)
    z, weights = (z + 1) / 2, weights / 2
    for degree, coefficient in enumerate(COSINE):
        assert 2 * (weights * z) @ eval_legendre(degree, z) == pytest.approx(coefficient, abs=1e-14)


@pytest.mark.parametrize("glossiness", [1.0, 4.0, 50.0])
def test_specular_is_the_light_convolved_with_the_lobe(mi, unit, bright, glossiness):
    normals, view = unit(20), unit(20)
    directions, weights = _sphere(40)
    across = _mirrored(view, normals) @ directions.T
    lobe = sum(
        (2 * n + 1) / (4 * math.pi) * math.exp(-n * n / (2 * glossiness)) * eval_legendre(n, across)
        for n in range(40)
    )
    expected = 0.7 * (lobe * weights) @ (_harmonics(directions) @ bright)
    radiance = _shade(mi, normals, bright, view=view, ks=0.7, glossiness=glossiness)
    np.testing.assert_allclose(radiance, expected, rtol=1e-5)


def test_specular_is_nearly_phongs_lobe(mi, unit, bright):
    """cos^g around the mirrored ray, normalised; what the exponentials stand for."""
    normals, view, g = unit(20), unit(20), 20.0
    directions, weights = _sphere(100)
    lobe = (_mirrored(view, normals) @ directions.T).clip(0) ** g * (g + 1) / (2 * math.pi)
    expected = (lobe * weights) @ (_harmonics(directions) @ bright)
    radiance = _shade(mi, normals, bright, view=view, ks=1.0, glossiness=g)
    np.testing.assert_allclose(radiance, expected, rtol=0.02)


def test_glossiness_sharpens_up_to_a_mirror(mi, unit, bright):
    normals, view = unit(50), unit(50)
    mirror = _harmonics(_mirrored(view, normals)) @ bright
    errors = []
    for g in (1.0, 2.0, 8.0, 100.0, 1e6):
        radiance = _shade(mi, normals, bright, view=view, ks=1.0, glossiness=g)
        errors.append(np.abs(radiance - mirror).mean())
    assert all(b < 0.9 * a for a, b in zip(errors[:-1], errors[1:], strict=True)) and errors[-1] < 1e-5


def test_the_last_band_is_left_out(mi, unit, rng):
    normals, light = unit(10), rng.uniform(0.0, 0.1, COEFFICIENTS)
    light[0] = 4.0
    radiance = _shade(mi, normals, light, ks=1.0, glossiness=1e9)
    expected = _harmonics(normals)[:, :RENDERED] @ light[:RENDERED]
    np.testing.assert_allclose(radiance[:, 0], expected, rtol=1e-5)


def test_light_of_one_channel_is_that_of_three_equal_ones(mi, unit, bright):
    normals, view, grey = unit(10), unit(10), bright[:, 0]
    options = {"view": view, "kd": [0.2, 0.5, 0.8], "ks": 0.3, "glossiness": 5.0}
    flat = _shade(mi, normals, grey, **options)
    np.testing.assert_array_equal(flat, _shade(mi, normals, grey[:, None], **options))
    np.testing.assert_allclose(flat, _shade(mi, normals, np.stack([grey] * 3, axis=1), **options), rtol=1e-6)


def test_negative_radiance_is_clamped(mi):
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    radiance = _shade(mi, normals, _alone(2), kd=1.0)
    assert radiance[0, 0] > 0.3 and (radiance[1] == 0).all()


def test_light_from_one_side_turns_with_the_object(mi, unit, rng):
    """L(w) = 1 + a . w by hand; turning it is turning a, and the same as turning normals and views back."""
    normals, view, a = unit(30), unit(30), np.array([0.3, -0.5, 0.4])
    turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turned *= np.linalg.det(turned)

    def light(towards):
        l1 = math.sqrt(4 * math.pi / 3)
        first = [-l1 * towards[1], l1 * towards[2], -l1 * towards[0]]
        return np.array([math.sqrt(4 * math.pi), *first, *[0.0] * 12])

    options = {"kd": 0.6, "ks": 0.4, "glossiness": 3.0}
    radiance = _shade(mi, normals, light(turned @ a), view=view, **options)[:, 0]
    back = _shade(mi, normals @ turned, light(a), view=view @ turned, **options)[:, 0]
    np.testing.assert_allclose(radiance, back, rtol=1e-5)
    gloss = math.exp(-1 / 6)
    mirrored = _mirrored(view, normals) @ turned @ a
    expected = 0.6 * (1 + 2 / 3 * normals @ turned @ a) + 0.4 * (1 + gloss * mirrored)
    np.testing.assert_allclose(radiance, expected, rtol=1e-5)


def test_gradients_are_finite_differences(mi, unit, rng):
    """Of a random sum of colours, with respect to everything; float32, so a wide central difference."""
    from mitex.runtime.jit import dr

    count = 12
    light = np.zeros((16, 3))
    light[:9] = rng.uniform(-0.3, 0.3, (9, 3))
    light[0] = 4.0
    inputs = {
        "normal": unit(count).T,
        "view": unit(count).T,
        "kd": rng.uniform(0.2, 0.9, (3, count)),
        "ks": rng.uniform(0.2, 0.9, count),
        "glossiness": rng.uniform(1.0, 6.0, count),
        "light": light,
    }
    kinds = dict(
        zip(inputs, (mi.Vector3f, mi.Vector3f, mi.Color3f, mi.Float, mi.Float, mi.TensorXf), strict=True)
    )
    factors = mi.Color3f(rng.normal(size=(3, count)).astype(np.float32))

    def loss(arrays):
        return dr.sum(dr.dot(factors, to_display(shade(*arrays.values()))))

    def attach(values):
        return {name: kinds[name](np.ascontiguousarray(v, np.float32)) for name, v in values.items()}

    arrays = attach(inputs)
    for array in arrays.values():
        dr.enable_grad(array)
    dr.backward(loss(arrays))
    for name, values in inputs.items():
        step = rng.normal(size=values.shape) * 1e-2
        ends = [loss(attach(inputs | {name: values + sign * step})).numpy()[0] for sign in (1, -1)]
        gradient = np.array(dr.grad(arrays[name]))
        assert (gradient * step).sum() == pytest.approx((ends[0] - ends[1]) / 2, rel=0.01, abs=1e-5), name


def test_display_is_the_power_but_next_to_black(mi):
    values = np.concatenate([np.linspace(0, 2, 2001), np.geomspace(1e-8, TOE, 2000), [-0.5]])
    display = np.array(to_display(upload(mi.Float, values.astype(np.float32))))
    exact = values.clip(0) ** (1 / 2.4)
    away = values >= TOE
    np.testing.assert_allclose(display[away], exact[away], rtol=1e-5)
    assert np.abs(display - exact).max() < 1.8 / 255
    order = np.argsort(values)
    assert (np.diff(display[order]) >= 0).all() and display[-1] == 0


def test_display_has_finite_gradients_everywhere(mi):
    from mitex.runtime.jit import dr

    linear = mi.Float([-1.0, 0.0, 1e-20, 5e-5, TOE * 1.001, 0.18, 1.0])
    dr.enable_grad(linear)
    dr.backward(dr.sum(to_display(linear)))
    gradient = np.array(linear.grad)
    assert np.isfinite(gradient).all() and gradient[0] == 0 and (gradient[2:] > 0).all()
    assert gradient[3] == pytest.approx(TOE ** (1 / 2.4 - 1), rel=1e-5) and gradient.max() < 220
    np.testing.assert_allclose(gradient[5:], np.array([0.18, 1.0]) ** (1 / 2.4 - 1) / 2.4, rtol=1e-5)


def _lat_long(height: int) -> np.ndarray:
    """Directions (H, 2H, 3) of the pixels of Mitsuba's `envmap`."""
    v, u = np.mgrid[:height, : 2 * height] + 0.5
    polar, turn = math.pi * v / height, math.pi * u / height
    axes = (np.sin(polar) * np.sin(turn), np.cos(polar), -np.sin(polar) * np.cos(turn))
    return np.stack(axes, axis=2)


@pytest.mark.parametrize("channels", [1, 3])
def test_projection_gives_back_the_coefficients_of_a_light(mi, rng, channels):
    light = rng.normal(size=(16, channels))
    image = (_harmonics(_lat_long(64).reshape(-1, 3)) @ light).reshape(64, 128, channels)
    coefficients = project_environment(image)
    assert coefficients.shape == (16, channels) and coefficients.dtype == np.float32
    np.testing.assert_allclose(coefficients, light, atol=3e-3)


def test_projection_of_a_uniform_environment_is_exact_at_any_size(mi):
    coefficients = project_environment(np.full((2, 5, 1), 0.5, np.float32))
    assert coefficients[0, 0] == pytest.approx(0.5 * math.sqrt(4 * math.pi), rel=1e-6)


def test_projection_lies_as_mitsubas_environment_maps_do(mi, unit):
    """Seen through Mitsuba's own plugin: a smooth environment, in a mirror."""
    colours = np.array([[0.5, 0.1, 0.0], [0.2, -0.4, 0.1], [0.1, 0.2, 0.6]])
    image = (1 + _lat_long(64) @ colours).astype(np.float32)
    emitter = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(image)})
    directions = unit(40)
    interaction = mi.SurfaceInteraction3f()
    interaction.wi = mi.Vector3f(np.ascontiguousarray(-directions.T, np.float32))
    expected = np.array(emitter.eval(interaction)).T
    radiance = _shade(mi, directions, project_environment(image), ks=1.0, glossiness=1e9)
    np.testing.assert_allclose(radiance, expected, atol=0.04)


@pytest.mark.parametrize("shape", [(4, 8), (4, 8, 4), (0, 8, 3)])
def test_environments_of_other_shapes_are_refused(shape):
    with pytest.raises(ImageError, match="an environment of shape"):
        project_environment(np.zeros(shape, np.float32))


def test_environments_that_are_not_finite_are_refused():
    image = np.ones((4, 8, 3), np.float32)
    image[1, 2, 0] = np.inf
    with pytest.raises(ImageError, match="NaN or infinite"):
        project_environment(image)


def test_a_turned_light_shines_from_the_turned_side(rng):
    light = rng.normal(size=(16, 3)).astype(np.float32)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    ways = rng.normal(size=(50, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    before, now = _harmonics(ways) @ light, _harmonics(ways @ turn.T) @ rotated(light, turn)
    np.testing.assert_allclose(now, before, atol=1e-4)
    flat = rotated(light[:, 0], turn)
    assert flat.shape == (16,)
    np.testing.assert_allclose(flat, rotated(light, turn)[:, 0], atol=1e-5)
