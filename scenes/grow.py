"""Grow two bundled textures on an embedded mesh, one of them turned by 45 degrees, side by side.

usage: python scenes/grow.py [OUT.png]
"""

import sys

from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods.nca import NcaTexture
from mitex.render import sheet, still, tone

mesh = embedded("knot")
pebbles = NcaTexture.load("pebbles").apply(mesh, seed=1)
waffle = NcaTexture.load("waffle").apply(mesh, seed=1, orientation=45)
pictures = [tone(still(asset, resolution=384, spp=64)) for asset in (pebbles, waffle)]
print(write_image(sys.argv[1] if len(sys.argv) > 1 else "grow.png", sheet(pictures, columns=2)))
