"""Fields with one row for each vertex refuse meshes with other numbers of vertices, in plain Mitsuba too."""

import subprocess
import sys

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.runtime import raise_causes
from mitex.runtime.upload import upload
from mitex.scenes.shapes import mesh_shape
from tests.textures.helpers import FACES, QUAD, quad

ROWS = "'data' has 3 rows, but the mesh 'quad' has 4 vertices; give one row for each vertex"
PLAIN = """
import mitex.plugins
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
triangle = mi.Mesh("triangle", 3, 1)
triangle.write_ply("triangle.ply")
texture = {"type": "vertex_field", "data": mi.TensorXf([0.5] * 5, (5, 1))}
shape = {"type": "ply", "filename": "triangle.ply", "bsdf": {"type": "diffuse", "reflectance": texture}}
film = {"type": "hdrfilm", "width": 4, "height": 4}
sensor = {"type": "perspective", "film": film}
scene = mi.load_dict({"type": "scene", "shape": shape, "sensor": sensor, "sky": {"type": "constant"}})
mi.render(scene, integrator=mi.load_dict({"type": "path"}), spp=1)
"""


def field(mi, rows: int) -> dict:
    return {"type": "vertex_field", "data": upload(mi.TensorXf, np.full((rows, 3), 0.5, np.float32))}


def decoded(mi) -> dict:
    """With states for the three vertices of a triangle."""
    tensors = {
        "data": np.zeros((3, 1)),
        "vertices": QUAD[:3],
        "faces": FACES[:1],
        "weight_0": np.ones((3, 1)),
    }
    tensors["bias_0"] = np.zeros(3)
    return {"type": "decoded_field"} | {
        k: upload(mi.TensorXf, v.astype(np.float32)) for k, v in tensors.items()
    }


def world(mi, bsdf: dict, **entries):
    film = {"type": "hdrfilm", "width": 4, "height": 4}
    view = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    sensor = {"type": "perspective", "to_world": view, "film": film}
    scene = {"type": "scene", "integrator": {"type": "path"}, "quad": quad(mi, bsdf), "sensor": sensor}
    return mi.load_dict(scene | {"sky": {"type": "constant"}} | entries)


def material(texture: dict, place: str) -> dict:
    if place == "bump":
        return {"type": "bumpmap", "height": texture, "nested": {"type": "diffuse"}}
    if place == "nested":
        texture = {"type": "checkerboard", "color0": texture}
    return {"type": "twosided", "nested": {"type": "diffuse", "reflectance": texture}}


@pytest.mark.parametrize("place", ["colour", "nested", "bump"])
@pytest.mark.parametrize("integrator", ["path", "prb"])
def test_rendering_a_mesh_with_other_rows_is_an_error(mi, place: str, integrator: str):
    scene = world(mi, material(field(mi, 3), place))
    with pytest.raises(ConfigError, match=f"vertex_field: {ROWS}"), raise_causes():
        mi.render(scene, integrator=mi.load_dict({"type": integrator}), spp=1)


def test_a_decoded_field_of_another_mesh_is_an_error(mi):
    scene = world(mi, {"type": "diffuse", "reflectance": decoded(mi)})
    with pytest.raises(ConfigError, match=f"decoded_field: {ROWS}"), raise_causes():
        mi.render(scene, spp=1)


@pytest.mark.parametrize("integrator", ["field", "name"])
def test_imaging_a_mesh_with_other_rows_is_an_error(mi, integrator: str):
    options = {"field": field(mi, 3)} if integrator == "field" else {"name": "reflectance"}
    scene = world(mi, {"type": "diffuse", "reflectance": field(mi, 3)})
    with pytest.raises(ConfigError, match=ROWS):
        mi.load_dict({"type": "feature"} | options).render(scene)


def test_a_lookup_on_another_mesh_is_an_error(mi):
    """On a mesh that does not show the texture; points elsewhere do not matter."""
    texture, shape = mi.load_dict(field(mi, 3)), quad(mi, {"type": "diffuse"})
    scene = mi.load_dict({"type": "scene", "quad": shape})
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f([0.1, 3], [0.2, 3], 3.0), mi.Vector3f(0, 0, -1)))
    with pytest.raises(ConfigError, match="3 rows"):
        texture.eval(si, mi.Bool([True, True]))
    texture.eval(si, mi.Bool([False, True]))


def test_a_scene_in_memory_with_other_rows_does_not_matter(mi):
    """Kernels are traced for its materials as well."""
    wrong = world(mi, {"type": "diffuse", "reflectance": field(mi, 3)})
    right = world(mi, {"type": "diffuse", "reflectance": field(mi, 4)})
    assert np.isfinite(np.array(mi.render(right, spp=1))).all()
    del wrong


def test_new_rows_and_new_vertices_are_checked(mi):
    scene = world(mi, {"type": "diffuse", "reflectance": field(mi, 4)})
    params = mi.traverse(scene)
    mi.render(scene, spp=1)
    params["quad.bsdf.reflectance.data"] = upload(mi.TensorXf, np.zeros((3, 3), np.float32))
    params.update()
    with pytest.raises(ConfigError, match=ROWS), raise_causes():
        mi.render(scene, spp=1)


def test_each_mesh_has_its_own_rows(mi):
    ball = icosphere(2)
    bsdf = {"type": "diffuse", "reflectance": field(mi, len(ball.vertices))}
    entries = {"ball": mesh_shape(ball, bsdf), "lamp": {"type": "sphere", "center": [0, 9, 0]}}
    scene = world(mi, {"type": "diffuse", "reflectance": field(mi, 4)}, **entries)
    assert np.isfinite(np.array(mi.render(scene, spp=1))).all()


def test_a_plain_script_says_so(tmp_path):
    result = subprocess.run([sys.executable, "-c", PLAIN], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 1
    assert (
        "ConfigError: vertex_field: 'data' has 5 rows, but the mesh 'shape' has 3 vertices" in result.stderr
    )
