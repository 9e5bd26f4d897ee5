"""Settings of a synthesis that takes a second, and its task."""

from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.layout import with_layout
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.task import SurfaceTask
from mitex.training import resolve

SMALL = ["resolution=48", "exemplar_size=48", "steps=12", "scales=0", "checkpoint_every=6", "preview_every=0"]
SMALL += ["start=noise"]  # which is there at once
SHALLOW = [*SMALL, "layers=relu1_1,relu2_1"]  # where it matters little what is compared


def small_task(mesh: Mesh, exemplar: Exemplar, *settings: str) -> SurfaceTask:
    config = resolve(PRESETS, None, None, [*SHALLOW, *settings])
    laid = with_layout(mesh, config.resolution)
    return SurfaceTask(config, exemplar, SurfaceDomain.of(laid, config))
