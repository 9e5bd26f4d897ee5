"""The command-line options of flat pictures that are optimized by Gram matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mitex.methods.planar_options import PlanarFitOptions, PlanarOptions


@dataclass(kw_only=True)
class Fit(PlanarFitOptions):
    """Optimize a flat picture until its features have the Gram matrices of an exemplar's albedo, as Gatys et
    al. (2015) do.

    `mitex apply RUN --mesh MESH --out ASSET` puts the picture on any mesh by its UVs. Ctrl-C saves, and
    --resume goes on.

    examples:
      mitex fit gatys --exemplar lava --out runs/flat-lava
      mitex fit gatys --exemplar pebbles.png --set size=512 periodic=true
      mitex fit gatys --exemplar lava --out runs/flat-lava --resume
    """

    method: ClassVar[str] = "gatys"


@dataclass(kw_only=True)
class Apply(PlanarOptions):
    """Put an optimized picture on a mesh by its UVs; where charts meet, the pattern breaks.

    examples:
      mitex apply runs/flat-lava --mesh vase --out vase.glb
      mitex apply runs/flat-lava --mesh bunny.obj --out bunny.png --scale 0.5 --keep-uvs
    """
