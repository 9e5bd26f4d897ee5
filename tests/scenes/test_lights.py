"""Lights: they load, they light, and the studio is where it says."""

import numpy as np

from mitex.scenes.lights import environment, key_light, studio_image


def sphere_picture(mi, lights: dict, radius: float = 1.0) -> np.ndarray:
    to_world = mi.ScalarTransform4f().look_at(origin=[0, 0, 5 * radius], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": 24, "height": 24, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 20, "to_world": to_world, "film": film}
    scene = {
        "type": "scene",
        "integrator": {"type": "path"},
        "sensor": sensor,
        "ball": {"type": "sphere", "radius": radius},
    }
    return np.array(mi.render(mi.load_dict(scene | lights), spp=64, seed=1))


def test_studio_image():
    image = studio_image(32)
    assert image.shape == (32, 64, 3)
    assert image.dtype == np.float32
    assert np.isfinite(image).all()
    assert image.min() > 0
    assert image.max() > 4
    assert image[0].mean() > image[-1].mean()  # brighter above


def radiance_from(mi, light: dict, direction: tuple[float, float, float]) -> float:
    si = mi.SurfaceInteraction3f()
    si.wi = -mi.Vector3f(mi.ScalarVector3f(direction)) / float(np.linalg.norm(direction))
    return mi.load_dict(light).eval(si)[1][0]


def test_softboxes_are_where_the_studio_says(mi):
    """Relative to a camera on +z: key to its left, fill to its right, rim opposite."""
    light = environment()
    directions = ((-0.8, 0.9, 0.9), (1.2, 0.3, 0.7), (0.9, 1.6, -0.9), (0.0, 0.0, -1.0))
    key, fill, rim, wall = (radiance_from(mi, light, direction) for direction in directions)
    assert key > rim > 4
    assert 1 < fill < 2
    assert wall < 0.5


def test_the_environment_has_its_key_on_the_left(mi):
    picture = sphere_picture(mi, {"light": environment()})[..., 1]
    assert picture[5:10, 6:11].mean() > 1.3 * picture[14:19, 13:18].mean()


def test_key_is_upper_left_at_any_size(mi):
    picture = sphere_picture(mi, {"key": key_light()})[..., 1]
    assert picture[5:10, 6:11].mean() > 1.5 * picture[14:19, 13:18].mean() > 0
    small = sphere_picture(mi, {"key": key_light(radius=0.1)}, radius=0.1)[..., 1]
    np.testing.assert_allclose(small, picture, atol=0.02)
    bright = sphere_picture(mi, {"key": key_light(3.0)})[..., 1]
    np.testing.assert_allclose(bright, 3 * picture, rtol=1e-3)
