"""Measures whether textures from words have the colours and the pattern that the words say.

usage: python tools/measure_words.py MESH[,MESH ...] RUN [RUN ...]

A RUN is a texture of `mitex fit nca --text`. It grows on a sphere and on the MESHes. At each vertex the name
of the nearest colour is taken, light and dark ones as their plain names. `pieces` are connected places of the
colour that is named first, on an area as large as a close-up of the training. `across` are the stripes of
that colour on a line across them as long as a close-up is wide, as many as have such long borders. A medium
pattern has 4.6 to 6 elements across, or 21 to 36 pieces. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from word_pictures import RGB

from mitex.features.words import concepts
from mitex.features.words.vocabulary import COLOURS
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture

SPHERE = "sphere"
FEWEST = 4  # vertices of a piece
SHADES = ("dark", "light", "colourful")


class Measures(NamedTuple):
    """Shares of the vertices, by the name of their colour, and the pattern (see above)."""

    shares: dict[str, float]
    pieces: float
    across: float


def named(text: str) -> list[str]:
    """The colours that a text names, in its order."""
    return [word for word in concepts(text) if word in COLOURS and word not in SHADES]


def colour_names(albedo: np.ndarray) -> np.ndarray:
    """(V,) plain names of the colours nearest to (V, 3) sRGB values."""
    plain = np.array([name.split()[-1] for name in RGB])
    distances = np.linalg.norm(albedo[:, None] - np.stack(list(RGB.values())), axis=2)
    return plain[distances.argmin(1)]


def measured(mesh: Mesh, names: np.ndarray, figure: str, density: float) -> Measures:
    """Of a mesh whose vertices have colours of these names.

    Args:
        mesh: V vertices, all edges about as long.
        names: (V,).
        figure: the colour whose pieces count.
        density: width of a close-up [edges].
    """
    inside, graph = names == figure, mesh.edges
    joined = inside[graph.rows] == inside[graph.indices]
    together = csr_array(
        (joined.astype(np.int8), (graph.rows, graph.indices)), shape=(len(names), len(names))
    )
    together.eliminate_zeros()
    _, label = connected_components(together, directed=False)
    sizes = np.bincount(label[inside], minlength=1)
    area = len(names) * math.sqrt(3) / 2  # [square edges], each vertex has two triangles
    pieces = (sizes >= FEWEST).sum() * density**2 / area
    # Edges lie at all angles, with 2 / pi of their length across the stripes; a stripe has two borders.
    across = (1 - joined.mean()) * density * math.pi / 4
    values, counts = np.unique(names, return_counts=True)
    shares = dict(zip(values.tolist(), (counts / len(names)).tolist(), strict=True))
    return Measures(shares, float(pieces), float(across))


def row(texture: NcaTexture, surface: str) -> str:
    """A line of the table."""
    mesh = icosphere(32) if surface == SPHERE else Mesh.load(surface)
    asset = texture.apply(mesh, resolution=None, keep_dense=True)
    text = str(texture.about["text"])
    colours = named(text)
    result = measured(asset.mesh, colour_names(asset.vertex_maps["albedo"]), colours[0], texture.density)
    rest = {name: share for name, share in result.shares.items() if name not in colours}
    most = max(rest, key=lambda name: rest[name], default="none")
    said = ", ".join(f"{name} {result.shares.get(name, 0):.0%}" for name in colours)
    other = f"{sum(rest.values()):.0%} ({most})"
    return f"| {text} | {asset.mesh.name} | {said} | {other} | {result.pieces:.1f} | {result.across:.1f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("meshes")
    parser.add_argument("runs", nargs="+")
    arguments = parser.parse_args()
    print("| text | on | colours | others (the most) | pieces | across |\n" + "| --- " * 6 + "|")
    for run in arguments.runs:
        texture = NcaTexture.load(run)
        for surface in (SPHERE, *arguments.meshes.split(",")):
            print(row(texture, surface), flush=True)


if __name__ == "__main__":
    main()
