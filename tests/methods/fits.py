"""A tiny fit of each method, as words of the command line: what the contract test runs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from tests.cli import bad_files as bad


@dataclass(frozen=True)
class TinyFit:
    """Words after `mitex fit METHOD`, and after `mitex apply RUN`.

    Attributes:
        fit: what is learned, and settings that make it quick.
        apply: on which mesh, and options that make it quick.
        resume: words with which the fit is resumed; empty if the method does not train.
        source: method whose run it learns from, if any.
    """

    fit: str
    apply: str
    resume: str = "--resume --steps 3"
    source: str = ""


SMALL_RUN = "checkpoint_every=1 preview_every=0"
RADIANCE = "rays=512 table=11 occupancy=32 ray_steps=96"
FITS = {
    "checkerboard": TinyFit("--exemplar lava --steps 2", "--mesh cube.obj --offset 0.5"),
    "nca": TinyFit(
        "--exemplar photo.png --steps 2 --set frequency=4 pool=1 view_count=1 resolution=32 target_size=32 "
        f"exemplar_size=32 hidden=8 min_steps=2 max_steps=2 layers=relu1_1 order_weight=0 "
        f"zooms=1 decoder_width=8 {SMALL_RUN}",
        "--mesh cube.obj --subdivide 1 --steps 2 --resolution 64",
    ),
    "surface": TinyFit(
        "--exemplar photo.png --mesh cube.obj --steps 2 --set resolution=32 exemplar_size=32 scales=0 "
        f"layers=relu1_1 start=noise {SMALL_RUN}",
        "--mesh cube.obj",
    ),
    "relief": TinyFit(
        "--exemplar lava --mesh cube.obj --steps 2 --set resolution=32 surface_steps=2 faces=200 view=32 "
        f"width=1 layers=relu1_1 {SMALL_RUN}",
        "--mesh cube.obj",
    ),
    "geometric": TinyFit(
        f"--reference cube.obj --steps 2 --set level_steps=2 fit_steps=10 fit_samples=100 {SMALL_RUN}",
        "--mesh cube.obj --start-level 0",
    ),
    "nerf": TinyFit(
        f"--capture photos --base-mesh base.obj --steps 2 --set base_steps=150 coarsest=8 "
        f"finest=32 {RADIANCE} {SMALL_RUN}",
        "--mesh ball.obj --size 128 --density 200",
    ),
    "plain_field": TinyFit(
        f"--capture photos --steps 2 --set {RADIANCE} {SMALL_RUN}",
        "--density 200",  # so much of the fog of two steps is solid
    ),
    "quilted": TinyFit(
        "--texture runs/nerf --set size=128 patches=4",
        "--mesh cube.obj --resolution 128",
        resume="",
        source="nerf",
    ),
    "nerf_tex": TinyFit(
        f"--texture runs/nerf --steps 2 --set patch=192 views=16 view=16 network=hash {RADIANCE} {SMALL_RUN}",
        "--mesh cube.obj --density 200 --scale 0.25 --spacing 2",
        source="nerf",
    ),
    "multi_view_gram": TinyFit(
        "--exemplar photo.png --mesh cube.obj --steps 2 --set resolution=32 exemplar_size=32 view=32 "
        f"layers=relu1_1 {SMALL_RUN}",
        "--mesh cube.obj",
    ),
    "gatys": TinyFit(
        "--exemplar photo.png --steps 2 --set size=32 resolution=32 exemplar_size=32 layers=relu1_1 "
        f"{SMALL_RUN}",
        "--mesh cube.obj --resolution 64",
    ),
    "image_quilting": TinyFit(
        "--exemplar photo.png --set size=32 resolution=32 exemplar_size=32 block=12",
        "--mesh cube.obj --resolution 64",
        resume="",
    ),
    "reaction_diffusion": TinyFit(
        "--exemplar photo.png --steps 2 --set channels=4 hidden=8 grid=32 exemplar_size=32 pool=1 "
        f"min_steps=1 max_steps=2 layers=relu1_1 {SMALL_RUN}",
        "--mesh cube.obj --resolution 64 --steps 2 --scale 4",
    ),
    "solid_texture": TinyFit(
        f"--exemplar photo.png --steps 2 --set exemplar_size=32 slice_size=32 layers=relu1_1 {SMALL_RUN}",
        "--mesh cube.obj --resolution 64 --scale 8",
    ),
    "style_mesh": TinyFit(
        "--exemplar photo.png --mesh cube.obj --steps 2 --set resolution=32 exemplar_size=64 view=64 "
        f"views=2 layers=relu1_1 weights=1 small_layers=relu1_1 {SMALL_RUN}",
        "--mesh cube.obj",
    ),
    "text2mesh": TinyFit(
        "--exemplar photo.png --mesh cube.obj --steps 2 --set resolution=32 exemplar_size=32 view=32 "
        f"width=8 layers=relu1_1 {SMALL_RUN}",
        "--mesh cube.obj",
    ),
    "x_mesh": TinyFit(
        "--text dots --clip words --mesh cube.obj --steps 2 --set resolution=32 view=32 width=8 "
        f"frequencies=4 views=1 text_vertices=50 {SMALL_RUN}",
        "--mesh cube.obj",
    ),
    "displacement": TinyFit("--reference spikes --set resolution=16", "--mesh cube.obj", resume=""),
}


def prepare(folder: Path) -> None:
    """Writes the files that the words name."""
    from tests.cli.test_nerf import holed, icosphere, save
    from tests.methods.nerf.capture.ellipsoid import write

    bad.text(folder / "cube.obj", bad.CUBE)
    bad.image(folder / "photo.png")
    save(holed(54), folder / "base.obj")  # even enough not to be remeshed
    save(icosphere(6), folder / "ball.obj")
    write(folder / "photos", 16)


def few_patches(patch: pytest.MonkeyPatch) -> None:
    """Captured textures are synthesized from patches of at most 40 places, in place of 2000."""
    from mitex.methods.nerf import texture

    extract = texture.extract_patches

    def few(*arguments: Any, **options: Any) -> Any:
        return extract(*arguments, **options | {"count": min(options.get("count", 40), 40)})

    patch.setattr(texture, "extract_patches", few)


def coarse_grids(patch: pytest.MonkeyPatch) -> None:
    """What is solid in boxes on a mesh is looked for on a grid of an eighth of the cells."""
    patch.setattr("mitex.methods.baselines.nerf_tex.boxes.CELLS", 32)


def small_coarse_fields(patch: pytest.MonkeyPatch, **settings: int) -> None:
    """The coarse fields that base meshes get their shells from are small, and scanned in few pixels."""
    from mitex.methods.nerf.base import coarse

    patch.setattr(coarse, "COARSE", replace(coarse.COARSE, **{"ray_steps": 96, "table": 13, **settings}))
    patch.setattr(coarse, "SCAN_SIDE", 80)


def rough_surfaces(patch: pytest.MonkeyPatch) -> None:
    """The maps that reliefs begin with are synthesized from noise, by the features of one layer."""
    from mitex.methods.relief.config import ReliefConfig

    given = ReliefConfig.of_surface
    rough = {"start": "noise", "scales": 0, "layers": ("relu1_1",)}
    patch.setattr(ReliefConfig, "of_surface", property(lambda config: given.__get__(config) | rough))


def untrained_bases(patch: pytest.MonkeyPatch) -> None:
    """Base meshes get a shell at once, without the training that measures how thick it must be."""
    from mitex.methods.nerf.base.base_shape import given_base
    from mitex.methods.nerf.base.coarse import BaseShape

    def found(capture: Any, config: Any, base_mesh: Any, *_: Any, **__: Any) -> BaseShape:
        base = given_base(base_mesh)
        return BaseShape(base, base.vertices, thickness=0.15)

    patch.setattr("mitex.methods.nerf.fitting.find_base", found)
