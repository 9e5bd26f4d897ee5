"""Films of a texture that grows, moves, or heals."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
import torch

from mitex.asset import DEFAULT_ALBEDO
from mitex.atlas import Atlas
from mitex.cache import content_key
from mitex.colour import linear_to_srgb
from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.growth import Growth
from mitex.methods.nca.ranges import MOST_STEPS
from mitex.methods.nca.region import region
from mitex.progress import announce
from mitex.render import OrbitRenderer, tone
from mitex.render.preview import PreviewRenderer
from mitex.render.recording import Recording
from mitex.render.renderer import check_elevation, check_resolution, check_samples
from mitex.runtime import keep_freed_memory

OF_THE_FILM = ("seconds", "loop")  # what no single picture follows from


@dataclass(frozen=True)
class FilmSettings:
    """How a texture is filmed.

    Attributes:
        seconds: of the film; of a loop, at most.
        fps: frames a second.
        steps_per_frame: of the automaton.
        start: steps before the first frame; None for 0, or as many as the model needs to be in order if the
            film is a loop or shows damage.
        renderer: "preview" for direct light, in a fraction of a second a frame; "path" for the path tracer.
        resolution: width and height [px].
        spp: samples a pixel of the path tracer.
        azimuth, elevation: from where the mesh is seen [degrees].
        loop: frames over which the film fades into its beginning; None for one that just ends.
        damage: a region that is set back to the seed, see `mitex.methods.nca.region`; None for none.
        damage_at: when [s].
    """

    seconds: float = 4.0
    fps: int = 24
    steps_per_frame: int = 2
    start: int | None = None
    renderer: Literal["preview", "path"] = "preview"
    resolution: int = 384
    spp: int = 32
    azimuth: float = 25.0
    elevation: float = 18.0
    loop: int | None = None
    damage: str | None = None
    damage_at: float = 0.5

    @property
    def frames(self) -> int:
        """How many there are."""
        return round(self.seconds * self.fps)

    @property
    def damaged_frame(self) -> int:
        """The first frame that shows the damage."""
        return round(self.damage_at * self.fps)

    @property
    def texels(self) -> int:
        """Side of the textures that are baked for the path tracer: two across a pixel."""
        return min(max(2 * self.resolution, 256), 2048)

    def first_step(self, steps: int) -> int:
        """After how many steps the film starts, of a texture that is in order after `steps`."""
        if self.start is not None:
            return self.start
        return 0 if self.loop is None and self.damage is None else steps

    def damaged(self, mesh: Mesh) -> torch.Tensor | None:
        """Which vertices are damaged, (V,) bool; None for no damage.

        Raises:
            ConfigError: there are none in the region, or it is none.
        """
        if self.damage is None:
            return None
        inside = region(self.damage)(mesh.vertices)
        if not inside.any():
            raise ConfigError(f"nothing of '{mesh.name}' is in '{self.damage}'", "choose another region")
        return torch.from_numpy(inside)

    def check(self) -> None:
        """Raises a ConfigError if a number is out of range that nothing else checks before work begins."""
        if self.renderer not in ("preview", "path"):
            raise ConfigError(f"there is no renderer '{self.renderer}'", "use preview or path")
        for name in ("seconds", "damage_at", "azimuth"):
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f"{name} is {getattr(self, name)}", "give a number")
        check_resolution(self.resolution)
        check_elevation(self.elevation, floating=self.renderer == "preview")
        if self.renderer == "path":
            check_samples(self.spp)
        if not 1 <= self.steps_per_frame <= MOST_STEPS:
            raise ConfigError(f"{self.steps_per_frame} steps a frame", f"use 1 to {MOST_STEPS}")
        if self.start is not None and not 0 <= self.start <= MOST_STEPS:
            raise ConfigError(f"a start after {self.start} steps", f"use 0 to {MOST_STEPS}")
        if self.damage is not None and not 0 <= self.damaged_frame < self.frames:
            raise ConfigError(
                f"damage at {self.damage_at:g} s in a film of {self.seconds:g} s", "choose a time within it"
            )

    def recording(self, path: str | os.PathLike[str], settings: Mapping[str, Any]) -> Recording:
        """The film's place and frames, checked; `settings` are what its pictures follow from."""
        self.check()
        return Recording.of(path, self.frames, self.fps, self.resolution, settings, self.loop)


def film(
    growth: Growth, path: str | os.PathLike[str], settings: FilmSettings, seed: int, resume: bool = False
) -> Path:
    """Films what grows, on the mesh that it is for.

    Args:
        growth: the automaton.
        path, resume: as of `GrowingTexture.animate`; errors too.
        settings: how, `start` among it.
        seed: of the random updates.
    """
    mesh = growth.cells.base
    states = States(growth, settings, seed, settings.damaged(growth.cells.mesh))
    scene = {"mesh": content_key(mesh.vertices, mesh.faces), "texture": growth.key, "seed": seed}
    scene |= {name: value for name, value in asdict(settings).items() if name not in OF_THE_FILM}
    recording = settings.recording(path, scene)
    keep_freed_memory()
    camera: Camera = (PreviewCamera if settings.renderer == "preview" else TracedCamera)(mesh, settings)

    def pictures(done: int) -> Iterator[np.ndarray]:
        return map(camera.picture, map(growth.texture, states.frames(done, recording.pictures)))

    return recording.record(pictures, resume)


@dataclass(frozen=True, eq=False)
class States:
    """The states of a film's frames.

    Attributes:
        growth, settings, seed: as of `film`.
        damage: (V,) bool, the cells that are set back; None for none.
    """

    growth: Growth
    settings: FilmSettings
    seed: int
    damage: torch.Tensor | None

    def frames(self, done: int, frames: int) -> Iterator[torch.Tensor]:
        """Those of all frames but the first `done`, whose steps are taken at once, so that a film goes on
        exactly as if it had not been interrupted.
        """
        generator = torch.Generator().manual_seed(self.seed)
        state = self.growth.evolve(self.growth.seed(), self.settings.start or 0, generator)
        for frame in range(done):
            announce("growing what has been filmed", frame, done)
            state = self._next(self._damaged(state, frame), generator)
        return self._following(state, generator, range(done, frames))

    def _following(
        self, state: torch.Tensor, generator: torch.Generator, frames: range
    ) -> Iterator[torch.Tensor]:
        for frame in frames:
            state = self._damaged(state, frame)
            yield state
            state = self._next(state, generator)

    def _damaged(self, state: torch.Tensor, frame: int) -> torch.Tensor:
        if self.damage is None or frame != self.settings.damaged_frame:
            return state
        return torch.where(self.damage[:, None], 0.0, state)

    def _next(self, state: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        return self.growth.evolve(state, self.settings.steps_per_frame, generator)


class Camera(Protocol):
    """Takes pictures of states on one mesh."""

    def picture(self, grown: GrownTexture) -> np.ndarray:
        """(H, W, 3) sRGB in [0, 1] of what a state shows."""
        ...


class PreviewCamera:
    """Direct light, in a fraction of a second a picture."""

    def __init__(self, mesh: Mesh, settings: FilmSettings) -> None:
        self._renderer = PreviewRenderer(
            mesh,
            resolution=settings.resolution,
            azimuth=settings.azimuth,
            elevation=settings.elevation,
        )
        self._normals = unit(
            interpolate(self._renderer.barycentric, mesh.shading_normals[self._renderer.face])
        )

    def picture(self, grown: GrownTexture) -> np.ndarray:
        points = self._renderer.face, self._renderer.barycentric
        maps = grown.maps(grown.values(*points))
        albedo = maps.get("albedo", np.full((len(self._normals), 3), linear_to_srgb(DEFAULT_ALBEDO)))
        normals = grown.detail_normals(maps, self._normals, *points)
        return self._renderer.render(albedo, normals, maps.get("ambient_occlusion", 1.0))


class TracedCamera:
    """The path tracer, with textures baked for each picture."""

    def __init__(self, mesh: Mesh, settings: FilmSettings) -> None:
        self._settings = settings
        self._atlas = Atlas.build(mesh, settings.texels, layout=mesh.uv)
        self._renderer: OrbitRenderer | None = None

    def picture(self, grown: GrownTexture) -> np.ndarray:
        asset = replace(grown.asset(), atlas=self._atlas, texture_maps=grown.textures(self._atlas))
        settings = self._settings
        if self._renderer is None:
            self._renderer = OrbitRenderer(asset, resolution=settings.resolution)
            self._view = self._renderer.fit_view(settings.azimuth, settings.elevation)
        else:
            self._renderer.show(asset)
        return tone(self._renderer.render(settings.azimuth, self._view, settings.spp))
