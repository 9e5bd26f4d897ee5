"""Learned textures: the cell rule, and putting what it grows on any mesh."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np
import torch

from mitex.asset import Asset
from mitex.atlas import Atlas, laid_out
from mitex.mesh import Mesh
from mitex.methods.nca import files
from mitex.methods.nca.cells import Cells, scale_of_width
from mitex.methods.nca.displacement import known_relief
from mitex.methods.nca.field import fields
from mitex.methods.nca.film import FilmSettings, film
from mitex.methods.nca.growth import Growth, LookGrowth, grown_state
from mitex.methods.nca.healing import healed
from mitex.methods.nca.look import Look, weights_key
from mitex.methods.nca.motion.cell_motion import STILL, CellMotion, look_motion, tile_motion
from mitex.methods.nca.motion.condition import Field, Motion
from mitex.methods.nca.orientation import Orientation, Turn, cell_turns
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.perception import lattice_perception
from mitex.methods.nca.ranges import MOST_STEPS, square_cells
from mitex.methods.nca.tile import flat_cells, relief_normals, tile_maps
from mitex.progress import announce

STEPS = 200  # of models that do not say it; enough to cover a surface
DENSITY = 32.0  # cells along the exemplar's width, of models that do not say it


class GrowingTexture(ABC):
    """What automata grow on any mesh: a texture that was learned, or two of them grafted.

    Attributes:
        about: how it was made, as JSON values; name at least.
    """

    about: Mapping[str, Any]

    @property
    @abstractmethod
    def steps(self) -> int:
        """Of the automaton, until the pattern is in order."""

    @property
    def density(self) -> float:
        """Cells along the exemplar's width, as it was learned."""
        density = self.about.get("density")
        return float(density) if isinstance(density, int | float) and density > 0 else DENSITY

    @abstractmethod
    def growth_on(
        self,
        cells: Cells,
        base: Mesh,
        orientation: Orientation = 0.0,
        field: Field | None = None,
        speed: float = 1.0,
    ) -> Growth:
        """The automaton on a mesh; options and errors as of `apply`, whose vectors are those of `base`."""

    def apply(
        self,
        mesh: Mesh,
        *,
        seed: int = 0,
        steps: int | None = None,
        subdivide: int | str = "auto",
        orientation: Orientation = 0.0,
        scale: float = 1.0,
        exemplar_width: float | None = None,
        resolution: int | None = 1024,
        keep_dense: bool = False,
        displace: bool = False,
        field: Field | None = None,
        speed: float = 1.0,
    ) -> Asset:
        """Grows the texture on a mesh.

        The automaton runs on a subdivided copy of the mesh; the size of the pattern follows the density of
        its vertices: each level of subdivision halves it.

        Args:
            mesh: any mesh; near-uniform edges and valence 6 give the best texture (`mitex.mesh.quality`).
            seed: of the random updates.
            steps: of the automaton; None for as many as the model's pattern needs to be in order.
            subdivide: levels of subdivision, or "auto": as many as bring the copy to 8,000 vertices.
            orientation: turns the texture about the normals, counter-clockwise [degrees]; or a vector field
                that its up follows, see `mitex.mesh.fields`.
            scale: size of the pattern, 1 for what the density gives; others need a remeshing of the copy to
                the fitting density (extra `remesh`).
            exemplar_width: in place of `scale`: how wide the exemplar is, 0.5 as on a surface texture [sides
                of the layout's square, see `mitex.methods.layout`].
            resolution: of the baked textures [texels], on the mesh's own UVs if nothing in them overlaps,
                else on new ones. None leaves the maps at the vertices.
            keep_dense: returns the finer mesh itself, rounded by Loop subdivision, instead of the given one.
            displace: moves the vertices by the relief of a texture from words, which else is a normal map
                alone; a mesh of few vertices needs `keep_dense` to show it.
            field: vector field that the texture moves along while it grows, see `mitex.mesh.fields`; None for
                the one that it was trained with, if any.
            speed: factor of the field, whose mean length is 1.

        Returns:
            An asset on the given mesh, with one map per learned map.

        Raises:
            ConfigError: options out of range; a field or a speed as of `motion`; a texture without a relief
                that shall displace it.
            MeshError: the mesh cannot be remeshed.
        """
        if exemplar_width is not None:
            scale *= scale_of_width(mesh, exemplar_width, self.density, subdivide)
        laid = mesh if resolution is None or (keep_dense and scale != 1.0) else laid_out(mesh, resolution)
        announce("preparing the mesh")
        cells = (Cells.dense if keep_dense else Cells.of)(laid, subdivide, scale)
        growth = self.growth_on(cells, mesh, orientation, field, speed)
        growth = growth.displaced() if displace else growth
        grown = growth.texture(_healthy(growth, seed, self.steps if steps is None else steps))
        asset = grown.asset()
        if resolution is None:
            return asset
        atlas = Atlas.build(cells.base, resolution, max(min(8, resolution // 8), 1), cells.base.uv)
        return replace(asset, atlas=atlas, texture_maps=grown.textures(atlas))

    def animate(
        self,
        mesh: Mesh,
        path: str | os.PathLike[str],
        *,
        seed: int = 0,
        subdivide: int | str = "auto",
        orientation: Orientation = 0.0,
        scale: float = 1.0,
        field: Field | None = None,
        speed: float = 1.0,
        resume: bool = False,
        **settings: Any,
    ) -> Path:
        """Films the texture as it grows, changes, or heals, before a camera that stays.

        Args:
            mesh: any mesh.
            path: of the film: .mp4, .gif, or a new folder for its frames as PNG.
            seed, subdivide, orientation, scale, field, speed: as of `apply`.
            resume: goes on with a film that was interrupted, whose frames are in a hidden folder beside it.
            settings: as of `mitex.methods.nca.film.FilmSettings`: seconds, fps, loop, damage, and others.

        Returns:
            The path written.

        Raises:
            ConfigError: an option out of range, or a field as of `apply`.
            OutputError: another kind of file, an unwritable place, or nothing there to resume.
            KeyboardInterrupt: stopped after a whole frame.
        """
        shot = FilmSettings(**settings)
        shot.recording(path, {})  # refuses what it can before the work starts
        laid = mesh if shot.renderer == "preview" else laid_out(mesh, shot.texels)
        announce("preparing the mesh")
        cells = Cells.of(laid, subdivide, scale)
        growth = self.growth_on(cells, mesh, orientation, field, speed)
        return film(growth, path, replace(shot, start=shot.first_step(self.steps)), seed, resume)

    def variants(
        self, mesh: Mesh, seeds: Iterable[int], *, resolution: int | None = 1024, **options: Any
    ) -> Iterator[Asset]:
        """One asset for each seed, all on one mesh and one UV layout, with the seed in its name; options as
        of `apply`.
        """
        laid = mesh if resolution is None else laid_out(mesh, resolution)
        for seed in seeds:
            asset = self.apply(laid, seed=seed, resolution=resolution, **options)
            yield replace(asset, name=f"seed {seed}")


@dataclass(frozen=True, eq=False)
class NcaTexture(GrowingTexture):
    """A trained MeshNCA.

    Attributes:
        look: the cell rule, and the decoder that shows its states.
        about: how it was made: name, exemplar, preset, steps, seconds, loss, ...
    """

    look: Look
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> NcaTexture:
        """Loads a bundled model by name, a model file, or a run folder.

        Raises:
            CheckpointError: there is no such model, or it is damaged.
        """
        return cls(*files.load(source))

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors, about 70 KB with a decoder)."""
        return files.save(Path(path), self.look, self.about)

    def fields(
        self,
        mesh: Mesh,
        *,
        seed: int = 0,
        steps: int | None = None,
        orientation: Orientation = 0.0,
        **motion: Unpack[Motion],
    ) -> dict[str, dict[str, Any]]:
        """Grows the texture on a mesh and returns it as textures of a Mitsuba scene, by map, which are
        decoded where rays meet the surface: `{"type": "principled", "base_color": fields["albedo"], ...}`.

        A cell sits at each vertex of the mesh, and the shape in the scene must have these vertices; see
        `mitex.mesh.subdivide_midpoint`. Other arguments and errors as of `apply`.
        """
        growth = self.growth_on(Cells(mesh, 0, mesh), mesh, orientation, **motion)
        return fields(self.look, _healthy(growth, seed, self.steps if steps is None else steps), mesh)

    def tile(
        self,
        resolution: int = 1024,
        *,
        cells: int | None = None,
        seed: int = 0,
        steps: int | None = None,
        field: Field | None = None,
        speed: float = 1.0,
    ) -> dict[str, np.ndarray]:
        """Grows the texture on a flat square whose opposite sides are joined.

        Args:
            resolution: side of the maps [px], 16 to 8192.
            cells: along a side, 8 to 1024; if None, the exemplar appears about `REPEATS` times along it.
            seed, steps, speed: as of `apply`.
            field: as of `apply`, but the same everywhere, as any other has a seam; None for "right" if it has
                learned to move.

        Returns:
            Maps (N, N, c) float32 in [0, 1], row 0 on top, the exemplar's up upwards; they go on at their
            opposite sides. The relief of a texture from words is there as normals, too.

        Raises:
            ConfigError: options out of range, or a field as of `apply`.
        """
        lattice = flat_cells(square_cells(self.density) if cells is None else cells, resolution)
        operator = lattice_perception(lattice, self.look.rule.degree, self.look.mean)
        cells_of_square = Cells(lattice.joined, 0, lattice.joined)
        motion = tile_motion(self.look, self.about, lattice, field, speed)
        growth = LookGrowth(self.look, cells_of_square, 0.0, self._palette, operator, motion)
        state = _healthy(growth, seed, self.steps if steps is None else steps)
        maps = tile_maps(self.look, state, lattice, resolution, self._palette)
        bound = known_relief(self.about, self.look.maps)
        return maps | {"normal": relief_normals(maps["height"], bound, lattice)} if bound else maps

    def grow(
        self,
        mesh: Mesh,
        *,
        seed: int = 0,
        steps: int | None = None,
        orientation: Orientation = 0.0,
        **motion: Unpack[Motion],
    ) -> torch.Tensor:
        """The state of the automaton after some steps, held within the bounds of the training's.

        Args:
            mesh: any mesh.
            seed: of the random updates.
            steps: from the initial state, which is zero; None as of `apply`.
            orientation: as in `apply`.
            motion: field and speed, as in `apply`.

        Returns:
            (V, C) float32.

        Raises:
            ConfigError: steps below 0, or a field as of `apply`.
        """
        growth = self.growth_on(Cells(mesh, 0, mesh), mesh, orientation, **motion)
        return grown_state(growth, seed, self.steps if steps is None else steps)

    def motion(
        self,
        cells: Cells,
        field: Field | None = None,
        speed: float = 1.0,
        orientation: Turn = 0.0,
        base: Mesh | None = None,
    ) -> CellMotion:
        """How the cells move along a vector field.

        Args:
            cells: the automaton's mesh.
            field: see `mitex.mesh.fields`; None for the one that the texture was trained with, if any.
            speed: factor of the field, whose mean length is 1.
            orientation: of the texture.
            base: whose vertices the vectors of a file or an array belong to; None for `cells.base`.

        Raises:
            ConfigError: a field that the texture cannot follow, or that cannot be used on the mesh; a speed
                of a texture that stands still.
        """
        return look_motion(self.look, self.about, base or cells.base, cells.mesh, field, speed, orientation)

    def growth(self, cells: Cells, orientation: Turn = 0.0, motion: CellMotion = STILL) -> LookGrowth:
        """The automaton on a mesh, its texture turned, its cells moving."""
        relief = known_relief(self.about, self.look.maps)
        return LookGrowth(self.look, cells, orientation, self._palette, motion=motion, relief=relief)

    def growth_on(
        self,
        cells: Cells,
        base: Mesh,
        orientation: Orientation = 0.0,
        field: Field | None = None,
        speed: float = 1.0,
    ) -> LookGrowth:
        turn = cell_turns(orientation, cells.mesh, base)
        return self.growth(cells, turn, self.motion(cells, field, speed, turn, base))

    @property
    def steps(self) -> int:
        """Of the automaton, until the pattern is in order (`settling_steps`)."""
        steps = self.about.get("growth_steps")
        return steps if isinstance(steps, int) and 0 < steps <= MOST_STEPS else STEPS

    @property
    def family(self) -> str:
        """What it has in common with textures that were trained from it, or from what it was trained from."""
        return str(self.about.get("family") or weights_key(self.look))

    @property
    def _palette(self) -> Palette | None:
        record = self.about.get("palette")
        return None if record is None else Palette.from_record(record)


def _healthy(growth: Growth, seed: int, steps: int) -> torch.Tensor:
    """As `grown_state`, with the exemplar's colours."""
    return healed(growth, grown_state(growth, seed, steps), torch.Generator().manual_seed(seed))
