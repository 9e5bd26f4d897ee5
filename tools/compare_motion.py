"""Measures how textures of `nca` flow on meshes: where to, how fast, and what is left of the look.

usage: python tools/compare_motion.py MOVING[:STILL] ... [--fields F ...] [--meshes M ...] [--judge J]

MOVING and STILL are models, run folders or bundled names; STILL is the texture that MOVING was trained from.
Without it the look is not compared, as of textures from words, which have no exemplar.
Close-ups of the albedo, four pixels an edge of the cells' mesh, are taken some steps apart. The judge, Lucas
and Kanade's method or the flow network (--judge flow), estimates the motion between them, which is compared
with that of the field, where that is at least a fifth of its mean. The look is compared with the exemplar, by
the Frechet distance of VGG-16's features at relu2_2, some steps after the pattern is in order, as a multiple
of the still texture's. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
import torch

from mitex.evaluation.metrics import single_image_frechet
from mitex.evaluation.motion import measured_motion
from mitex.exemplar import Exemplar
from mitex.features.flow import EstimatorName
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import Growth
from mitex.methods.nca.motion.cell_motion import STILL, follows_fields, period
from mitex.methods.nca.motion.condition import cell_vectors
from mitex.scenes.cameras import Cameras, patch_views
from mitex.scenes.screen import surface_motion
from mitex.scenes.stage import Hits, Stage

SPHERE = "sphere"
FREQUENCY = 32  # of the sphere that textures are trained on
VIEWS, SIDE, PIXELS = 6, 128, 4  # close-ups, their side [px], and pixels an edge
FRAMES, STEPS = 4, 4  # of a film, and steps of the automaton between two of them
SLOWEST = 0.2  # edges in a period: where a field is weaker, what changes by itself would count as motion
LATER = (50, 500, 1000)  # steps after which the look is compared


@dataclass(frozen=True, eq=False)
class CloseUps:
    """Places of a surface that cameras look at.

    Attributes:
        cells: the automaton's mesh, which is the one that is seen.
    """

    cells: Cells
    cameras: Cameras
    hits: Hits

    @staticmethod
    def of(mesh: Mesh) -> CloseUps:
        fine = Cells.dense(mesh).mesh
        half = 0.5 * SIDE / PIXELS * float(np.median(fine.edge_lengths))
        cameras = patch_views(torch.Generator().manual_seed(0), fine, VIEWS, half, SIDE)
        return CloseUps(Cells(fine, 0, fine), cameras, Stage(fine).hits(cameras))

    @property
    def face(self) -> np.ndarray:
        """(P,) under each pixel that sees the surface."""
        return self.hits.face.numpy()

    @property
    def barycentric(self) -> np.ndarray:
        """(P, 3)."""
        return self.hits.barycentric.numpy()

    @property
    def covered(self) -> np.ndarray:
        """(K, H, W) bool."""
        return self.hits.hit.numpy().reshape(self.cameras.shape)

    def moving(self, field: np.ndarray) -> np.ndarray:
        """(K, H, W) bool, where cells' vectors (V, 3) are so long that the pattern should be seen to move."""
        length = np.linalg.norm(field, axis=1, keepdims=True)[self.cells.mesh.faces[self.face]]
        return self._image(interpolate(self.barycentric, length))[..., 0] > SLOWEST

    def pictures(self, growth: Growth, state: torch.Tensor) -> np.ndarray:
        """The albedo (K, H, W, 3) of a state, black where there is no surface."""
        grown = growth.texture(state)
        albedo = grown.maps(grown.values(self.face, self.barycentric))["albedo"]
        return self._image(albedo)

    def target(self, field: np.ndarray) -> np.ndarray:
        """Motion (K, H, W, 2) of the cells' vectors (V, 3), of which 1 is an edge [px]."""
        mesh = self.cells.mesh
        return surface_motion(self.cameras, mesh, self.hits, field * mesh.edge_lengths[:, None])

    def _image(self, values: np.ndarray) -> np.ndarray:
        image = np.zeros((*self.cameras.shape, values.shape[1]), np.float32)
        image[self.covered] = values
        return image


def motion_of(
    texture: NcaTexture,
    closeups: CloseUps,
    field: str,
    later: tuple[int, ...],
    judge: EstimatorName = "lucas-kanade",
) -> tuple[float, float, list[float]]:
    """Direction error [degrees], speed ratio, and distances from the exemplar after so many steps each."""
    guided = follows_fields(texture.look, texture.about)  # else as it was trained
    growth = texture.growth(closeups.cells, 0.0, texture.motion(closeups.cells, field) if guided else STILL)
    generator = torch.Generator().manual_seed(0)
    state = growth.evolve(growth.seed(), texture.steps, generator)
    mesh = closeups.cells.mesh
    vectors = cell_vectors(mesh, mesh, field, 1.0).astype(np.float64)
    films = np.stack(list(film(growth, state, closeups)), axis=1)
    errors = [
        measured_motion(frames, motion, moving, steps=STEPS, period=period(texture.about), judge=judge)
        for frames, motion, moving in zip(
            films, closeups.target(vectors), closeups.moving(vectors), strict=True
        )
        if moving.mean() > 0.5
    ]
    looks = []
    for before, after in zip((0, *later), later, strict=False):
        state = growth.evolve(state, after - before, generator)
        looks.append(distance(texture, closeups, growth, state))
    direction, ratio = (
        float(np.mean([getattr(e, key) for e in errors])) for key in ("direction", "speed_ratio")
    )
    return direction, ratio, looks


def film(growth: Growth, state: torch.Tensor, closeups: CloseUps) -> Iterator[np.ndarray]:
    """Close-ups (K, H, W, 3), `STEPS` apart."""
    generator = torch.Generator().manual_seed(1)
    for _ in range(FRAMES):
        yield closeups.pictures(growth, state)
        state = growth.evolve(state, STEPS, generator)


def distance(texture: NcaTexture, closeups: CloseUps, growth: Growth, state: torch.Tensor) -> float:
    """Mean Frechet distance of close-ups from the exemplar, as wide as it is there."""
    pixels = round(PIXELS * float(texture.about["density"]))
    exemplar = Exemplar.load(texture.about["exemplar"]).resized(pixels).maps["albedo"]
    pictures = zip(closeups.pictures(growth, state), closeups.covered, strict=True)
    distances = [
        single_image_frechet(exemplar, view, mask_b=seen) for view, seen in pictures if seen.mean() > 0.5
    ]
    return float(np.mean(distances))


def still_distance(texture: NcaTexture, closeups: CloseUps) -> float:
    """The same of a still texture, once its pattern is in order."""
    growth = texture.growth(closeups.cells)
    state = growth.evolve(growth.seed(), texture.steps, torch.Generator().manual_seed(0))
    return distance(texture, closeups, growth, state)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--fields", nargs="+", default=["right", "about-x", "shear-up"])
    parser.add_argument("--meshes", nargs="+", default=[SPHERE, "octopus", "vase"])
    parser.add_argument("--judge", choices=get_args(EstimatorName), default="lucas-kanade")
    arguments = parser.parse_args()
    later = " | ".join(f"look after {steps:,}" for steps in LATER)
    print(f"| texture | mesh | field | direction | speed | {later} |\n" + "| --- " * (5 + len(LATER)) + "|")
    for mesh_name in arguments.meshes:
        mesh = icosphere(FREQUENCY) if mesh_name == SPHERE else Mesh.load(mesh_name)
        closeups = CloseUps.of(mesh)
        for pair in arguments.models:
            moving, *still = (NcaTexture.load(name) for name in pair.split(":"))
            reference = still_distance(still[0], closeups) if still else 1.0
            for field in arguments.fields:
                direction, ratio, looks = motion_of(
                    moving, closeups, field, LATER if still else (), arguments.judge
                )
                numbers = " | ".join([f"{look / reference:.2f}" for look in looks] or [""] * len(LATER))
                names = f"{moving.about['name']} | {Path(mesh_name).stem} | {field}"
                print(f"| {names} | {direction:.0f}° | {ratio:.2f} | {numbers} |", flush=True)


if __name__ == "__main__":
    with torch.no_grad():
        main()
