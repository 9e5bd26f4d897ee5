"""Learn a texture from words with the embedded model, and put it on two meshes.

usage: python scenes/text_texture.py [OUT.png] ["WORDS"]

Takes a few minutes on two cores.
"""

import sys
from collections.abc import Sequence

from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods import nca
from mitex.render import sheet, still, tone
from mitex.training.progress import ProgressDisplay

TEXT = "red dots on white"


def main(
    out: str = "dots.png",
    text: str = TEXT,
    settings: Sequence[str] = (),
    resolution: int = 384,
    spp: int = 64,
) -> None:
    with ProgressDisplay() as on_step:
        texture = nca.fit_text(text, clip="words", set=settings, on_step=on_step)
    assets = [texture.apply(embedded(name)) for name in ("vase", "knot")]
    pictures = [tone(still(asset, resolution=resolution, spp=spp)) for asset in assets]
    print(write_image(out, sheet(pictures, columns=2)))


if __name__ == "__main__":
    main(*sys.argv[1:2], text=sys.argv[2] if len(sys.argv) > 2 else TEXT)
