"""A learned texture: the cell rule, and putting what it grows on any mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset
from mitex.atlas import laid_out
from mitex.errors import ConfigError
from mitex.geometry.vectors import orthonormal, rotate_about, unit
from mitex.mesh import Mesh, remesh, subdivide_loop
from mitex.methods.nca import files
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.perception import perception
from mitex.methods.nca.targets import state_maps
from mitex.runtime import keep_freed_memory

STEPS = 200  # enough for the pattern to settle at every density tried
ENOUGH_VERTICES = 24_000  # "auto" subdivides until a mesh has them
MOST_LEVELS = 6
MOST_VERTICES = 4_000_000  # a gigabyte of states


@dataclass(frozen=True, eq=False)
class NcaTexture:
    """A trained MeshNCA.

    Attributes:
        model: the cell rule.
        maps: names of the maps that it grows.
        about: how it was made: name, exemplar, preset, steps, seconds, loss, ...
    """

    model: MeshNCA
    maps: tuple[str, ...]
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> NcaTexture:
        """Loads a bundled model by name, a model file, or a run folder.

        Raises:
            CheckpointError: there is no such model, or it is damaged.
        """
        model, about = files.load(source)
        return cls(model, tuple(about["maps"]), about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors, about 50 KB)."""
        return files.save(Path(path), self.model, {**self.about, "maps": list(self.maps)})

    def apply(
        self,
        mesh: Mesh,
        *,
        seed: int = 0,
        steps: int | None = None,
        subdivide: int | str = "auto",
        orientation: float = 0.0,
        scale: float = 1.0,
        resolution: int | None = 1024,
    ) -> Asset:
        """Grows the texture on a mesh.

        The size of the pattern follows the density of vertices: each level of subdivision halves it.

        Args:
            mesh: any mesh; near-uniform edges and valence 6 give the best texture (`mitex.mesh.quality`).
            seed: of the random updates.
            steps: of the automaton; 200 if None.
            subdivide: levels of Loop subdivision, or "auto": as many as bring the mesh to 24,000 vertices.
            orientation: turns the texture about the normals, counter-clockwise [rad].
            scale: size of the pattern, 1 for what the density gives; others need a remeshing to the fitting
                density (extra `remesh`).
            resolution: of the baked textures [texels]: UVs are laid out for it before the mesh is subdivided,
                which is much faster. None leaves the maps at the vertices.

        Returns:
            An asset on the subdivided mesh, in the mesh's own units and place, with one map per learned map.

        Raises:
            ConfigError: options out of range, or the model needs a condition.
            MeshError: the mesh cannot be remeshed.
        """
        self._check_unconditioned()
        laid = mesh if resolution is None or scale != 1.0 else laid_out(mesh, resolution)
        dense = self._dense(laid, subdivide, scale)
        state = self.grow(dense, seed=seed, steps=STEPS if steps is None else steps, orientation=orientation)
        maps = state_maps(state.numpy(), list(self.maps))
        asset = Asset(dense, maps, tangents(dense, orientation), name=mesh.name)
        if resolution is None:
            return asset
        return asset.baked(resolution, layout=dense.uv if scale == 1.0 else None)

    @torch.no_grad()
    def grow(
        self, mesh: Mesh, *, seed: int = 0, steps: int = STEPS, orientation: float = 0.0, clamp: float = 1.0
    ) -> torch.Tensor:
        """The state of the automaton after some steps.

        Args:
            mesh: any mesh.
            seed: of the random updates.
            steps: from the initial state, which is zero.
            orientation: as in `apply` [rad].
            clamp: after each step the state is clamped to [-clamp, clamp], as in the authors' demo.

        Returns:
            (V, C) float32.

        Raises:
            ConfigError: steps below 0, or the model needs a condition.
        """
        self._check_unconditioned()
        if steps < 0:
            raise ConfigError(f"{steps} steps", "give 0 or more")
        keep_freed_memory()
        operator = perception(mesh, self.model.degree, orientation)
        generator = torch.Generator().manual_seed(seed)
        state = self.model.seed(operator)
        for _ in range(steps):
            state = self.model.evolve(state, operator, 1, generator).clamp_(-clamp, clamp)
        return state[0]

    def _check_unconditioned(self) -> None:
        if self.model.condition:
            name, width = self.about.get("name", "the model"), self.model.condition
            raise ConfigError(
                f"'{name}' needs a condition of {width} values at each vertex, and has none here",
                "use a model that was trained without, or give the condition to MeshNCA.evolve in Python",
            )

    def _dense(self, mesh: Mesh, subdivide: int | str, scale: float) -> Mesh:
        if subdivide == "auto":
            levels = 0
            while len(mesh.vertices) * 4**levels < ENOUGH_VERTICES and levels < MOST_LEVELS:
                levels += 1
        else:
            levels = subdivide if isinstance(subdivide, int) else -1
        if not 0 <= levels <= MOST_LEVELS:
            raise ConfigError(f"subdivide = {subdivide}", f"use 'auto' or 0 to {MOST_LEVELS}")
        if not 0.05 <= scale <= 20:
            raise ConfigError(f"scale = {scale}", "use 0.05 to 20")
        count = len(mesh.vertices) * 4**levels
        if count * max(1 / scale**2, 1) > MOST_VERTICES:
            raise ConfigError(
                f"a mesh of more than {MOST_VERTICES:,} vertices", "subdivide less, or take a larger scale"
            )
        dense = subdivide_loop(mesh, levels) if levels else mesh
        return dense if scale == 1.0 else remesh(dense, max(int(len(dense.vertices) / scale**2), 12))


def tangents(mesh: Mesh, orientation: float = 0.0) -> np.ndarray:
    """Where the exemplar's right points on the surface, (V, 3) float32 unit vectors across the normals.

    Training views have +y up, so right is y x normal; `orientation` turns it about the normal [rad].
    """
    normals = mesh.normals
    right = orthonormal(np.cross(np.array([0, 1, 0], np.float32), normals), normals)
    return unit(rotate_about(right, normals, orientation)).astype(np.float32)
