"""The garbage collector frees no scene while a kernel is recorded."""

import gc
import subprocess
import sys
import weakref

from mitex.runtime import collection

# What an error's traceback or a cycle leaves behind is collected inside the texture of another scene.
SCRIPT = """
import gc
import numpy as np
import mitex
mitex.init()
from mitex.mesh import icosphere
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload
from mitex.scenes import mesh_shape
from mitex.textures import vertex_rows

def scene():
    mesh = icosphere(2)
    grey = np.full((len(mesh.vertices), 3), 0.5, np.float32)
    colour = {"type": "vertex_field", "data": upload(mi.TensorXf, grey)}
    film = {"type": "hdrfilm", "width": 8, "height": 8}
    shape = mesh_shape(mesh, {"type": "diffuse", "reflectance": colour}, smooth=True)
    sensor = {"type": "perspective", "film": film}
    parts = {"sensor": sensor, "shape": shape, "sky": {"type": "constant"}, "path": {"type": "path"}}
    return mi.load_dict({"type": "scene", **parts})

gc.disable()
first = scene()
cycle = [scene()]
cycle.append(cycle)
mi.render(cycle[0], spp=1)
del cycle
loaded_meshes, calls = vertex_rows.loaded_meshes, []
def collect():
    calls.append(gc.collect())
    return loaded_meshes()
vertex_rows.loaded_meshes = collect
np.array(mi.render(first, spp=1))
assert calls and gc.get_freeze_count() == 0
print("alive", gc.collect() > 0)
"""


class Node:
    """An object that refers to itself."""

    def __init__(self) -> None:
        self.itself = self


def test_a_scene_in_a_cycle_outlives_the_recording_of_another():
    process = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True)
    assert (process.returncode, process.stdout.split()) == (0, ["alive", "True"]), process.stderr


def test_collections_wait_while_a_kernel_is_recorded(monkeypatch):
    collection.collect_between_kernels()
    node = weakref.ref(Node())
    monkeypatch.setattr(collection, "_is_recording", lambda: True)
    gc.collect()
    assert node() is not None and gc.get_freeze_count() == 0
    monkeypatch.setattr(collection, "_is_recording", lambda: False)
    gc.collect()
    assert node() is None


def test_one_callback_however_often_it_is_asked_for():
    collection.collect_between_kernels()
    before = len(gc.callbacks)
    collection.collect_between_kernels()
    assert len(gc.callbacks) == before
