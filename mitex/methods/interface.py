"""What textures of all methods have in common, and what they make of a mesh."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, Self

if TYPE_CHECKING:
    import numpy as np

    from mitex.mesh import Mesh


class Applied(Protocol):
    """A texture on a mesh: an `Asset`, or a radiance field in the shell around the mesh."""

    @property
    def maps(self) -> Mapping[str, np.ndarray]:
        """What the surface wears, name -> float32 values, per vertex (V, C) or as an image (H, W, C)."""
        ...

    def export(self, path: str | os.PathLike[str], maps_format: Literal["png", "exr"] = "png") -> Path:
        """Writes it; the suffix chooses the format (.glb, .obj, .ply, .exr, .html), or it is a folder.

        Raises:
            OutputError: Another suffix, or an unwritable place.
        """
        ...

    def render(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Path-traces a still (.png, .jpg).

        Raises:
            OutputError: Another suffix, or an unwritable place.
            ConfigError: An option out of range.
        """
        ...


class Texture(Protocol):
    """What a fit learned."""

    @property
    def about(self) -> Mapping[str, Any]:
        """What is known of its training, as JSON values: name, preset, steps, seconds, loss and more."""
        ...

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """Reads a bundled model by name, a model file, or a run folder.

        Raises:
            CheckpointError: There is none, or it is damaged.
        """
        ...

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: The place is not writable.
        """
        ...

    def apply(self, mesh: Mesh, **options: Any) -> Applied:
        """Puts the texture on a mesh; options are the method's own.

        Raises:
            ConfigError: An option out of range, or a mesh that this texture cannot be put on.
            MeshError: A mesh that cannot be used.
        """
        ...
