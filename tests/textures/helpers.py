"""A quad, light on it, and a picture of a sphere, for tests of textures."""

import numpy as np

from mitex.geometry.tangents import Split
from mitex.mesh import Mesh, icosphere
from mitex.runtime.upload import upload
from mitex.scenes.shapes import mesh_shape

QUAD = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
FACES = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
LIGHT = np.array([0.3, 0.2, -1.0]) / np.linalg.norm([0.3, 0.2, -1.0])  # where a slanting one goes
GREY = {"type": "diffuse", "reflectance": 0.6}
BUMPS = {"type": "bumpmap", "bsdf": GREY, "use_shadowing_function": False}  # with a texture as `height`
NORMALS = {"type": "normalmap", "bsdf": GREY, "use_shadowing_function": False}  # and as `normalmap`
SLOPE = np.array([0.3, -0.5])  # of a height
NORMAL = np.array([0.3, -0.2, 0.93]) / np.linalg.norm([0.3, -0.2, 0.93])


def quad(mi, bsdf: dict, uv: np.ndarray | None = None):
    """A quad in the xy plane that faces +z."""
    mesh, split = Mesh(QUAD, FACES, name="quad"), None
    if uv is not None:
        split = Split(np.arange(4), mesh.faces, mesh.normals, uv, tangents=np.zeros((4, 4)))
    return mesh_shape(mesh, bsdf, split=split)


def radiance(mi, shape, x: np.ndarray, y: np.ndarray, light=(0.0, 0.0, -1.0)) -> np.ndarray:
    """(N, 3) exact radiance towards +z of points of a shape under a directional light of irradiance pi."""
    emitter = {"type": "directional", "direction": list(light), "irradiance": {"type": "rgb", "value": np.pi}}
    scene = mi.load_dict({"type": "scene", "shape": shape, "light": emitter})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, len(x))
    origin = mi.Point3f(upload(mi.Float, x), upload(mi.Float, y), 3.0)
    ray = mi.RayDifferential3f(mi.Ray3f(origin, mi.Vector3f(0, 0, -1)))
    value, _, _ = mi.load_dict({"type": "direct"}).sample(scene, sampler, ray)
    return np.array(value).T


def grey_radiance(normal: np.ndarray) -> float:
    """What leaves `GREY` under a directional light along `LIGHT`, as `radiance` has it, by its normal."""
    return 0.6 * float(np.dot(normal, -LIGHT) / np.linalg.norm(normal))


def interaction(mi, shape, face: np.ndarray, barycentric: np.ndarray):
    """Surface interactions at points of a mesh without UVs: faces (N,), barycentrics (N, 3). The caller keeps
    the shape.
    """
    from mitex.runtime.jit import dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(face))
    si.t, si.shape, si.prim_index = mi.Float(1), mi.ShapePtr(shape), upload(mi.UInt32, face.astype(np.uint32))
    si.uv = mi.Point2f(*(upload(mi.Float, weight) for weight in np.asarray(barycentric, np.float32).T[1:]))
    return si


def sphere_picture(mi, bsdf: dict) -> np.ndarray:
    to_world = mi.ScalarTransform4f().look_at(origin=[1, 2, 4], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": 16, "height": 16}
    sensor = {"type": "perspective", "fov": 28, "to_world": to_world, "film": film}
    light = {"type": "point", "position": [3, 4, 5], "intensity": 40.0}
    ball = mesh_shape(icosphere(4), bsdf)
    scene = {"type": "scene", "integrator": {"type": "path"}, "sensor": sensor, "light": light, "ball": ball}
    return np.array(mi.render(mi.load_dict(scene), spp=4))
