"""A learned geometric texture, and growing it on any mesh."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, get_args

import numpy as np
import torch

from mitex.asset import Asset, clay
from mitex.errors import ConfigError
from mitex.geometry.vectors import dot
from mitex.mesh import Mesh, subdivide_midpoint
from mitex.mesh.fields import vector_field
from mitex.mesh.untangling import untangled
from mitex.methods.checks import in_range
from mitex.methods.geometric import files
from mitex.methods.geometric.coarse_relief import CoarseRelief
from mitex.methods.geometric.config import Placement
from mitex.methods.geometric.directions import spread
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.geometric.placement import bumps, placed
from mitex.methods.geometric.rollout import Rollout, between, slerp
from mitex.methods.geometric.thickness import thickness
from mitex.progress import listening
from mitex.ranges import SEEDS
from mitex.runtime import keep_freed_memory

START = 2  # the paper starts at level 2 or 3
MOST_FACES = 4_000_000


@dataclass(frozen=True, eq=False)
class GeometricTexture:
    """Generators of successive levels.

    Attributes:
        generators: of levels 0 to `levels` - 1.
        template: the mesh that training started from, mean edge 1.
        fixed: (V, 3) the noise on it from which the reference comes, or the coarse part of its relief.
        about: how it was made; `levels`, `noise` and `remeasure` at least. `field` is "vector" if the relief
            follows a field, "line" if a vector of it and its opposite are the same. `first_level` is above 0
            if growth begins with the coarse part of the relief.
        fields: of such a relief, (V, 3) unit vectors or zero on the template of each level.
    """

    generators: Sequence[FaceNetwork]
    template: Mesh
    fixed: torch.Tensor
    about: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    fields: Sequence[torch.Tensor] = ()

    @property
    def levels(self) -> int:
        """Number of generators."""
        return len(self.generators)

    @cached_property
    def coarse(self) -> CoarseRelief | None:
        """What the first generator completes, if it has learned to."""
        if not self.about.get("first_level"):
            return None
        heights = dot(self.fixed.numpy().astype(np.float64), self.template.normals)
        field = self.fields[0].numpy() if self.fields else None
        symmetric = self.about.get("field") == files.LINE
        return CoarseRelief(self.template, heights, field, symmetric, kept=True)

    @property
    def first(self) -> int:
        """The level that growth on a mesh begins with, if nothing else is asked for."""
        return START if self.coarse is None else 0

    @classmethod
    def load(cls, source: str | Path) -> GeometricTexture:
        """Loads a model by file, run folder or bundled name.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        return cls(*files.load(source))

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors)."""
        return files.save(
            Path(path), list(self.generators), self.template, self.fixed, self.about, self.fields
        )

    def apply(
        self,
        mesh: Mesh,
        *,
        seed: int = 0,
        start_level: int | None = None,
        end_level: int | None = None,
        untangle: bool = False,
        field: str | Path | np.ndarray | None = None,
        placement: Placement = "even",
    ) -> Asset:
        """Grows the texture on a mesh; every level after the first splits each face in four.

        The borders of an open mesh stay where they are.

        The size of the texture follows the mesh's mean edge, whatever its connectivity and genus.

        Args:
            mesh: any mesh; near-uniform edges give an even texture (`mitex.mesh.remesh`).
            seed: of the noise.
            start_level: generator to begin with; if None, `first`, or `end_level` if that is lower. Low
                levels change the shape.
            end_level: the last generator; the last one trained if None.
            untangle: draw the relief back where the surface pierces itself; see `untangled`.
            field: the vector field on the mesh that the relief follows, if it has learned to follow one; see
                `mitex.mesh.fields`.
            placement: where bumps and dents go that are larger than a face of the first level: "even" spreads
                them as densely as on the reference (`geometric.placement`) if a relief has such and follows
                no field, or lays its coarse part anew (`geometric.coarse_relief`) if it begins with one;
                dents that would meet in thin walls are drawn back (`geometric.thickness`). "none" leaves all
                to the generators, as published.

        Returns:
            The displaced mesh in light grey, in the mesh's own units and place; UVs are interpolated.

        Raises:
            ConfigError: levels out of range, too many faces, an unknown placement, or a field that is
                missing, wrong or of no use.
            MeshError: a face names a vertex twice.
        """
        rollout = self.rollout(mesh, start_level, end_level, field, placement)
        *_, last = rollout.run(rollout.noise(seed), self._placed(mesh, rollout.level, placement, seed, field))
        return clay(untangled(rollout.hierarchy.meshes[-1], last) if untangle else last)

    def interpolate(
        self,
        mesh: Mesh,
        seeds: tuple[int, int],
        frames: int,
        *,
        start_level: int | None = None,
        end_level: int | None = None,
        field: str | Path | np.ndarray | None = None,
        placement: Placement = "even",
    ) -> Iterator[Mesh]:
        """Meshes between those of two seeds.

        Noise, and the heights that growth begins with, go along great circles, so that their variances stay.

        Args:
            mesh, start_level, end_level, field, placement: as in `apply`.
            seeds: of the first and the last mesh.
            frames: number of meshes, at least 2.
        """
        rollout = self.rollout(mesh, start_level, end_level, field, placement)
        first, last = (rollout.noise(seed) for seed in seeds)
        start, stop = (self._placed(mesh, rollout.level, placement, seed, field) for seed in seeds)
        for t in np.linspace(0, 1, frames):
            noise = [slerp(a, b, float(t)) for a, b in zip(first, last, strict=True)]
            *_, result = rollout.run(noise, between(mesh, start, stop, float(t)))
            yield result

    def generate(self, seed: int = 0, start_level: int = 0, end_level: int | None = None) -> Mesh:
        """A variation of the reference itself, from the template.

        Args:
            seed: of the noise.
            start_level: the first level with random noise; below it the reference's own global shape is
                rebuilt. Above the last level, the reference as a whole is rebuilt.
            end_level: as in `apply`.
        """
        rollout = self.rollout(self.template, 0, end_level)
        noise, vertices = rollout.noise(seed), self.template.vertices
        noise[:start_level] = [torch.zeros(())] * len(noise[:start_level])
        if self.coarse is not None:
            own = vertices + self.fixed.numpy()
            vertices = own if start_level else self._laid(self.coarse, seed)
        elif start_level:
            noise[0] = self.fixed
        *_, result = rollout.run(noise, vertices)
        return result

    def growth(
        self,
        mesh: Mesh,
        frames: int = 12,
        *,
        seed: int = 0,
        start_level: int | None = None,
        end_level: int | None = None,
        field: str | Path | np.ndarray | None = None,
        placement: Placement = "even",
    ) -> Iterator[Mesh]:
        """The texture growing on a mesh: the mesh itself, then `frames` meshes for each level.

        Arguments as in `apply`. The last of a level's meshes is displaced by the whole of it.
        """
        rollout = self.rollout(mesh, start_level, end_level, field, placement)
        before, vertices = mesh, self._placed(mesh, rollout.level, placement, seed, field)
        for level, after in enumerate(rollout.run(rollout.noise(seed), vertices)):
            start = subdivide_midpoint(before) if level else before
            for t in np.linspace(0, 1, frames + 1)[0 if level == 0 else 1 :]:
                yield after.with_vertices(start.vertices + t * (after.vertices - start.vertices))
            before = after

    def relative_size(
        self, mesh: Mesh, start_level: int | None = None, end_level: int | None = None
    ) -> tuple[float, int]:
        """How large features will be beside a mesh, in relation to their size beside the reference.

        Args:
            mesh, start_level, end_level: as in `apply`.

        Returns:
            That ratio, and the number of vertices to remesh to for a ratio of about 1.
        """
        start, _ = self._range(start_level, end_level)
        faces = len(self.template.faces) * 4**start
        return (faces / len(mesh.faces)) ** 0.5, max(faces // 2, 12)

    def rollout(
        self,
        mesh: Mesh,
        start_level: int | None,
        end_level: int | None,
        field: str | Path | np.ndarray | None = None,
        placement: Placement = "none",
    ) -> Rollout:
        """The generators of a range of levels, ready to run on a mesh; arguments and errors as of `apply`.

        The template has its own field, and dents of any depth.
        """
        own = mesh is self.template and self.fields and field is None
        self.check(
            mesh.name, len(mesh.faces), start_level, end_level, self.fields[0].numpy() if own else field
        )
        start, end = self._range(start_level, end_level)
        keep_freed_memory()
        generators = self.generators[start : end + 1]
        hierarchy = self._directed(Hierarchy.of(mesh, len(generators)), mesh, field)
        noise, remeasure = float(self.about["noise"]), bool(self.about["remeasure"])
        thick = None if placement == "none" or mesh is self.template else thickness(mesh)
        return Rollout(generators, hierarchy, start, noise, remeasure, thick)

    def check(
        self,
        name: str,
        faces: int,
        start_level: int | None = None,
        end_level: int | None = None,
        field: str | Path | np.ndarray | None = None,
    ) -> None:
        """Refuses what is wrong with a growth on any mesh of a number of faces.

        Args:
            name: of the mesh, for messages.
            faces: that it has, or will have once it is remeshed.
            start_level, end_level, field: as in `apply`.

        Raises:
            ConfigError: levels out of range, too many faces, or a field that is missing or of no use.
        """
        start, end = self._range(start_level, end_level)
        faces *= 4 ** (end - start)
        if faces > MOST_FACES:
            raise ConfigError(
                f"{name} would have {faces:,} faces after level {end}",
                f"stay below {MOST_FACES:,}: remesh it more coarsely, or use fewer levels",
            )
        if field is not None and self.about.get("field") is None:
            raise ConfigError("this relief has no direction and follows no `field`", "leave it out")
        if field is None and self.about.get("field") is not None:
            raise ConfigError("this relief follows a vector field", "give a `field`, such as up")

    def _placed(
        self,
        mesh: Mesh,
        level: int,
        placement: Placement,
        seed: int,
        field: str | Path | np.ndarray | None,
    ) -> np.ndarray:
        """Vertices (V, 3) of a mesh with bumps like those that the generators up to a level make.

        On the template, lower levels place them; where there are none, its coarse relief is laid anew.
        """
        in_range("`seed`", seed, *SEEDS)
        if placement not in get_args(Placement):
            raise ConfigError(f"placement {placement!r}", f"use {' or '.join(get_args(Placement))}")
        if mesh is self.template and self.coarse is not None and not level:
            return self._laid(self.coarse, seed)
        if placement == "none" or mesh is self.template:
            return mesh.vertices
        if self.coarse is not None:
            vectors = None if field is None else vector_field(mesh, field)
            return mesh.vertices if level else self.coarse.on(mesh, vectors)(seed)
        if self.about.get("field"):
            return mesh.vertices
        with listening(None):
            reference = self.generate(start_level=self.levels, end_level=level)
        texture = bumps(reference, 0.5**level)
        return mesh.vertices if texture is None else placed(mesh, texture, seed)

    def _laid(self, coarse: CoarseRelief, seed: int) -> np.ndarray:
        """Vertices (V, 3) of the template with its coarse relief laid anew, along its own field if any."""
        return coarse.on(self.template, coarse.field)(seed)

    def _directed(self, hierarchy: Hierarchy, mesh: Mesh, field: str | Path | np.ndarray | None) -> Hierarchy:
        """The hierarchy of a mesh with the directions that the relief follows; the template has its own."""
        kind = self.about.get("field")
        if kind is None:
            return hierarchy
        symmetric = kind == files.LINE
        if field is None:
            fields = self.fields[: len(hierarchy.meshes)]
        else:
            fields = spread(vector_field(mesh, field), hierarchy.pairs, symmetric)
        return hierarchy.directed(fields, symmetric)

    def _range(self, start_level: int | None, end_level: int | None) -> tuple[int, int]:
        """The first and the last level of a growth; see `apply` for what None stands for."""
        last = self.levels - 1
        end = last if end_level is None else end_level
        start = min(self.first, end) if start_level is None else start_level
        if not 0 <= start <= end <= last:
            raise ConfigError(
                f"levels {start} to {end} are out of range", f"this texture has the levels 0 to {last}"
            )
        return start, end
