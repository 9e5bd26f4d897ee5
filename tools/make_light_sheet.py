"""Shows a captured texture in the light of its photos, in the studio's, and behind a lattice.

    python tools/make_light_sheet.py RUN ...

Each RUN is a finished run of `mitex fit nerf`, and a row of docs/gallery/nerf-light.jpg: the texture on the
vase that ships with Mitex, three times, and the share of the light that the lattice leaves.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import mitex
from mitex.images import write_image
from mitex.mesh import Similarity, embedded
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.use.applied import AppliedTexture
from mitex.render import sheet, tone
from mitex.render.shell import shell_still

mitex.init()

from mitex.runtime.jit import mi  # noqa: E402
from mitex.textures.shell_field import shell_field  # noqa: E402

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
SIDE = 400  # of a picture [px]
SPP = 24
LAMP = np.array([-3.5, 3.2, 4.0])  # its place
BARS = 5  # each way


def lattice() -> dict[str, Any]:
    """Crossed bars between the lamp and the object."""
    towards = mi.ScalarTransform4f().look_at((0.4 * LAMP).tolist(), [0, 0, 0], [0, 1, 0])
    places = np.linspace(-0.75, 0.75, BARS)
    across = [towards.translate([float(x), 0, 0]).scale([0.06, 1.0, 0.02]) for x in places]
    along = [towards.translate([0, float(y), 0]).scale([1.0, 0.06, 0.02]) for y in places]
    return {f"bar{k}": {"type": "cube", "to_world": turn} for k, turn in enumerate(across + along)}


def under_a_lamp(applied: AppliedTexture, entries: dict[str, Any]) -> np.ndarray:
    """The texture on a floor, under a small lamp and a weak sky, with further entries of the scene."""
    outline = applied.outline
    centre = outline.mean(0)
    radius = float(np.linalg.norm(outline - centre, axis=1).max())
    own = applied.similarity
    field = shell_field(applied, Similarity((own.centre - centre) / radius, own.scale / radius))
    floor = mi.ScalarTransform4f().translate([0, float((outline[:, 1].min() - centre[1]) / radius), 0])
    scene = {
        "type": "scene",
        "integrator": {"type": "lit_shell", "field": field, "max_depth": 4},
        "sensor": {
            "type": "perspective",
            "fov": 30,
            "to_world": mi.ScalarTransform4f().look_at([0, 1.2, 4.2], [0, -0.05, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": SIDE, "height": SIDE},
        },
        "sky": {"type": "constant", "radiance": 0.3},
        "lamp": {
            "type": "sphere",
            "center": LAMP.tolist(),
            "radius": 0.08,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 4500.0}},
        },
        "floor": {"type": "rectangle", "to_world": floor.rotate([1, 0, 0], -90).scale(20)},
    }
    return np.array(mi.render(mi.load_dict(scene | entries), spp=SPP))[..., :3]


def main() -> None:
    cells, labels = [], []
    for run in map(Path, sys.argv[1:]):
        applied = NerfTexture.load(run).apply(embedded("vase"))
        cells += [
            tone(
                shell_still(
                    applied, applied.similarity, applied.outline, resolution=SIDE, spp=SPP, light=light
                )
            )
            for light in ("own", "scene")
        ]
        shaded, lit = under_a_lamp(applied, lattice()), under_a_lamp(applied, {})
        share = (shaded.mean(2) / np.maximum(lit.mean(2), 1e-4)).clip(0, 1)
        cells += [tone(shaded), np.repeat(share[..., None], 3, axis=2)]
        labels += [f"{run.name}, own light", "the studio's", "behind a lattice", "light that it leaves"]
    write_image(GALLERY / "nerf-light.jpg", sheet(cells, columns=4, labels=labels, cell=SIDE))


if __name__ == "__main__":
    main()
