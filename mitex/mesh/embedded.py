"""Meshes that ship with Mitex; `tools/make_meshes.py` makes them."""

from __future__ import annotations

from pathlib import Path

from mitex.errors import MeshError
from mitex.mesh.mesh import Mesh
from mitex.suggestions import suggestion

DATA = Path(__file__).parents[1] / "data" / "meshes"


def embedded_names() -> list[str]:
    """Names of the meshes that ship with Mitex."""
    return sorted(path.stem for path in DATA.glob("*.ply"))


def embedded(name: str) -> Mesh:
    """A mesh that ships with Mitex: nearly uniform edges, about 10,000 vertices, within the unit sphere.

    Raises:
        MeshError: there is none of that name.
    """
    names = embedded_names()
    if name not in names:
        raise MeshError(f"there is no embedded mesh {name}", suggestion(name, names))
    return Mesh.load(DATA / f"{name}.ply")
