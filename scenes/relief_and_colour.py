"""Grow a geometric texture on an embedded mesh, and a colour texture on what has grown.

usage: python scenes/relief_and_colour.py [OUT.png]
"""

import sys

from mitex.images import write_image
from mitex.mesh import embedded, remesh
from mitex.methods.geometric import GeometricTexture
from mitex.methods.nca import NcaTexture
from mitex.render import sheet, still, tone


def main(out: str = "relief.png", vertices: int = 10_000, resolution: int = 384, spp: int = 64) -> None:
    """Shows the mesh's relief alone, and with colours of a bundled texture."""
    mesh = remesh(embedded("vase"), vertices)  # fewer vertices, larger scales
    relief = GeometricTexture.load("scales").apply(mesh, seed=1)
    colour = NcaTexture.load("pebbles").apply(relief.mesh, seed=1)
    pictures = [tone(still(asset, resolution=resolution, spp=spp)) for asset in (relief, colour)]
    print(write_image(out, sheet(pictures, columns=2)))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "relief.png")
