"""What makes the work of the pages' commands small, and the files that they name.

Nothing of a command or a snippet is changed. What takes minutes is made small below it, whoever calls it:

- fits: their settings are resolved as they were asked for, which checks them; then they get 2 steps, 3 if the
  run is resumed, and the tiny settings of their method;
- meshes that ship with Mitex are balls of 362 vertices, as large as they and under their names;
- `--remesh` gives 200 vertices at most, and the gallery's rings have 60;
- reliefs that begin on a finer level begin on 320 faces, and their coarse parts are laid once in a fit, from
  the patches of 10 places; training meshes are measured at 500 points;
- automata grow for 2 steps on the mesh as it is, are not healed, and are baked at 64 texels, as the textures
  of baselines are;
- films have 4 frames of 32 pixels, of automata on the mesh as it is, as wide as pictures in pages are;
- the photos that pages name are 8 of a ball in 24 x 24 pixels, which is its own base shape; its texture is
  joined from 30 patches to 128 texels;
- pictures are traced in 16 x 16 pixels with one path each, and enlarged;
- jobs of a batch run in this process, comparisons look at one patch, and words are judged by one view.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mitex.mesh import Mesh, embedded, icosphere, remesh
from mitex.methods.registry import methods
from mitex.training.run import CONFIG
from tests.batch.in_this_process import InThisProcess
from tests.docs.blocks import ROOT, blocks
from tests.features.clip.folders import write_folder
from tests.methods.nerf.tiny import tiny_capture, write_capture

STEPS, RESUMED_STEPS = 2, 3
GROWTH = 2  # steps of an automaton
FIRST_LEVEL = 2  # of reliefs that begin on a finer level
REMESHED = 200  # vertices
RING = (10, 6)  # vertices around and across
TEXELS = 64
SIDE = 16  # of a picture [pixels]
EVERY_FIT = {"checkpoint_every": 1, "preview_every": 0}
TINY: dict[str, dict[str, Any]] = {
    # Nothing of the architecture, which must be that of the model after `--init`.
    "nca": {"frequency": 4, "pool": 1, "view_count": 1, "zooms": 1, "min_steps": 2, "max_steps": 2}
    | {"resolution": 32, "target_size": 32, "exemplar_size": 32, "layers": ("relu1_1",), "order_weight": 0.0}
    | {"motion_start": 0},
    "surface": {"resolution": 32, "exemplar_size": 32, "scales": 0, "layers": ("relu1_1",)}
    | {"text_views": 1, "text_view": 24},
    "gatys": {"size": 32, "exemplar_size": 32, "layers": ("relu1_1",)},
    "image_quilting": {"size": 32, "resolution": 32, "exemplar_size": 32, "block": 12},
    "multi_view_gram": {"resolution": 32, "exemplar_size": 32, "view": 32, "layers": ("relu1_1",)},
    "reaction_diffusion": {"hidden": 8, "channels": 4, "grid": 32, "exemplar_size": 32, "pool": 1}
    | {"min_steps": 2, "max_steps": 2, "layers": ("relu1_1",)},
    "text2mesh": {"resolution": 32, "exemplar_size": 32, "view": 32, "width": 8, "layers": ("relu1_1",)}
    | {"text_vertices": 100},
    "x_mesh": {"resolution": 32, "view": 32, "width": 8, "frequencies": 4, "views": 1, "text_vertices": 100},
    "style_mesh": {
        "resolution": 32,
        "exemplar_size": 64,
        "view": 64,
        "layers": ("relu1_1",),
        "weights": (1.0,),
    }
    | {"small_layers": ("relu1_1",), "views": 2},
    "solid_texture": {"exemplar_size": 32, "slice_size": 32, "layers": ("relu1_1",)},
    "nerf": {
        "base_steps": 2,
        "rays": 64,
        "ray_steps": 64,
        "table": 10,
        "coarsest": 4,
        "finest": 8,
        "occupancy": 16,
    },
    "nerf_tex": {
        "patch": 128,
        "views": 16,
        "view": 16,
        "rays": 64,
        "ray_steps": 64,
        "table": 10,
        "occupancy": 16,
    },
    "relief": {"resolution": 64, "faces": 200, "view": 32, "width": 1.0, "layers": ("relu1_1",)},
    "geometric": {"level_steps": 2, "fit_steps": 10, "fit_samples": 100},
}


def prepare(folder: Path) -> None:
    """Writes the files that pages name and that the user brings along, or has from a script."""
    write_folder(folder / "models" / "clip-b32")
    write_capture(tiny_capture(views=8, side=24, spp=1), folder / "captures" / "cobbles")
    for name, page, language in (("plan.toml", "batch.md", "toml"), ("strokes.json", "flow.md", "json")):
        block = next(block for block in blocks(ROOT / "docs" / page) if block.language == language)
        (folder / name).write_text(block.text)


def shrink(patch: pytest.MonkeyPatch) -> None:
    """Makes the work small until the patch is undone."""
    from mitex.methods.baselines.reaction_diffusion import ReactionDiffusionTexture
    from mitex.methods.baselines.solid_texture import SolidTexture
    from mitex.methods.nca import NcaTexture, page, texture
    from mitex.methods.nerf import NerfTexture, fitting
    from mitex.methods.planar import PlanarTexture
    from mitex.render import renderer, shell
    from mitex.training import fit

    patch.setattr(fit, "resolve", _with_few_steps(fit.resolve))
    patch.setattr("mitex.mesh.load.embedded", _ball_in_place_of)
    patch.setattr("mitex.mesh.remesh", lambda mesh, vertices: remesh(mesh, min(vertices, REMESHED)))
    few_steps = _with_few_growth_steps(texture.grown_state)
    for module in (texture, page):
        patch.setattr(module, "grown_state", few_steps)
    patch.setattr(page, "PICTURE", 32)
    patch.setattr(texture, "healed", lambda growth, state, generator: state)
    patch.setattr(texture, "film", _with_few_frames(texture.film))
    patch.setattr(texture.GrowingTexture, "apply", _small_growth(texture.GrowingTexture.apply))
    patch.setattr(texture.GrowingTexture, "animate", _without_subdivision(texture.GrowingTexture.animate))
    for kind in (PlanarTexture, SolidTexture):
        patch.setattr(kind, "apply", _at_few_texels(kind.apply))
    spots = ReactionDiffusionTexture
    patch.setattr(spots, "apply", _at_few_texels(spots.apply, steps=GROWTH))
    patch.setattr("mitex.batch.task.Process", InThisProcess)
    for name in ("PATCHES", "WINDOWS"):
        patch.setattr(f"mitex.comparison.look_pair.{name}", 1)
    patch.setattr("mitex.render.sides.AZIMUTHS", (0,))
    patch.setattr("mitex.render.sides.ELEVATIONS", (0.0,))
    patch.setattr(NcaTexture, "tile", _small_tile(NcaTexture.tile))
    patch.setattr("mitex.methods.geometric.references.FREQUENCY", 12)
    patch.setattr("mitex.methods.geometric.fitting.LAID", 1)
    patch.setattr("mitex.methods.geometric.coarse_patches.PLACES", 10)
    patch.setattr("mitex.methods.geometric.report.SAMPLES", 500)
    patch.setattr("mitex.methods.geometric.example.RINGS", (RING,))
    patch.setattr(fitting, "find_base", lambda *_, **__: _ball_as_base())
    patch.setattr(NerfTexture, "synthesize", _small_quilt(NerfTexture.synthesize))
    patch.setattr(NerfTexture, "synthesize_on", _small_quilt_on(NerfTexture.synthesize_on))
    sketch, sensor = _with_few_paths(renderer.accumulated), renderer.sensor
    for module in (renderer, shell):
        patch.setattr(module, "accumulated", sketch)
        patch.setattr(module, "sensor", lambda resolution: sensor(SIDE))


@cache
def _ball_in_place_of(name: str) -> Mesh:
    mesh = embedded(name)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    ball = icosphere(6)
    return replace(
        ball.with_vertices(0.5 * (low + high) + 0.5 * (high - low) * ball.vertices), name=mesh.name
    )


def _with_few_steps(resolve: Callable[..., Any]) -> Callable[..., Any]:
    def small(presets: Mapping[str, Any], preset: str | None, file: Path | None, settings: Any) -> Any:
        config = resolve(presets, preset, file, settings)
        defaults = {name: next(iter(method.load_presets().values())) for name, method in methods().items()}
        name = next(name for name, default in defaults.items() if type(default) is type(config))
        steps = STEPS if file is None or file.name != CONFIG else RESUMED_STEPS
        training = {"steps": steps, **EVERY_FIT} if hasattr(config, "steps") else {}
        if getattr(config, "first_level", 0):
            training["first_level"] = FIRST_LEVEL
        return replace(config, **training, **TINY.get(name, {}))

    return small


def _with_few_growth_steps(grown_state: Callable[..., Any]) -> Callable[..., Any]:
    def small(growth: Any, seed: int, steps: int) -> Any:
        return grown_state(growth, seed, min(steps, GROWTH))

    return small


def _with_few_frames(film: Callable[..., Any]) -> Callable[..., Any]:
    def small(growth: Any, path: Any, settings: Any, *others: Any) -> Any:
        loop = None if settings.loop is None else 1
        short = replace(settings, seconds=4 / settings.fps, resolution=32, start=2, loop=loop, damage_at=0.0)
        return film(growth, path, short, *others)

    return small


def _small_growth(apply: Callable[..., Any]) -> Callable[..., Any]:
    def small(texture: Any, mesh: Mesh, **options: Any) -> Any:
        texels = None if options.get("resolution", TEXELS) is None else TEXELS
        return apply(texture, mesh, **options | {"resolution": texels, "subdivide": 0})

    return small


def _without_subdivision(animate: Callable[..., Any]) -> Callable[..., Any]:
    def small(texture: Any, mesh: Mesh, path: Any, **options: Any) -> Any:
        return animate(texture, mesh, path, **options | {"subdivide": 0})

    return small


def _at_few_texels(apply: Callable[..., Any], **fixed: Any) -> Callable[..., Any]:
    def small(texture: Any, mesh: Mesh, **options: Any) -> Any:
        return apply(texture, mesh, **options | {"resolution": TEXELS} | fixed)

    return small


def _small_tile(tile: Callable[..., Any]) -> Callable[..., Any]:
    def small(texture: Any, resolution: int = TEXELS, **options: Any) -> Any:
        return tile(texture, TEXELS, **options | {"steps": GROWTH})

    return small


def _ball_as_base() -> Any:
    from mitex.methods.nerf.base.coarse import BaseShape

    ball = icosphere(30)
    return BaseShape(Mesh(0.7 * ball.vertices, ball.faces, name="ball"), 0.68 * ball.vertices, thickness=0.1)


def _small_quilt(synthesize: Callable[..., Any]) -> Callable[..., Any]:
    def small(texture: Any, size: Any = 128, *others: Any, **options: Any) -> Any:
        return synthesize(texture, 128, *others, **options | {"patches": 30})

    return small


def _small_quilt_on(synthesize_on: Callable[..., Any]) -> Callable[..., Any]:
    def small(texture: Any, mesh: Any, size: Any = 128, *others: Any, **options: Any) -> Any:
        return synthesize_on(texture, mesh, 128, *others, **options | {"patches": 30, "scale": 8.0})

    return small


def _with_few_paths(accumulated: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
    def small(scene: Any, resolution: int, spp: int, seed: int) -> np.ndarray:
        nearest = np.arange(resolution) * SIDE // resolution
        return accumulated(scene, SIDE, 1, seed)[nearest][:, nearest]

    return small
