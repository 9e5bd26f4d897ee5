"""`mitex capture`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from mitex.methods.checks import in_range


@dataclass(kw_only=True)
class MakeCapture:
    """Make a capture of a phone's video or of photos, for `mitex fit nerf --capture`.

    Picks sharp frames, finds the cameras, cuts the object out, and tells which sides to film again. The
    object stands still, before still surroundings with some pattern. It takes minutes to hours.

    examples:
      mitex capture vase.mp4 --out captures/vase
      mitex capture vase.mp4 --out captures/vase --mask box:30,20,40,70
      mitex capture vase.mp4 --out captures/vase --mask network:u2net.onnx
      mitex capture photos/ --out captures/vase --mask colour:#1e8f3c --frames 60
    """

    source: Annotated[Positional[Path], arg(metavar="VIDEO|PHOTOS")]
    """Video (.mp4 .mov and others), or folder of photos (.png .jpg)."""

    out: Annotated[Path, arg(metavar="CAPTURE")]
    """Folder to make."""

    mask: Annotated[str, arg(metavar="plane|hull|box:X,Y,W,H|colour:#RRGGBB|network:FILE")] = "plane"
    """What the object is. plane: what stands on a table in the middle. hull: what all pictures have in their
    middle. box: what is in a box of the first picture, by its left and upper edge, width and height [per cent
    of the picture]. colour: what differs from the background, which has that colour. network: what a network
    of yours takes for it, an ONNX file such as U2-Net; network:FILE.onnx,PX,MEAN,STD if the pictures that it
    takes are not as the file says, or not normalised by ImageNet's mean and standard deviation."""

    frames: Annotated[int, arg(metavar="N")] = 80
    """Pictures to pick, at most."""

    resolution: Annotated[int, arg(metavar="N")] = 1600
    """Longer side of the capture's pictures, at most [pixels]."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        in_range("--frames", self.frames, 8, 1000)
        in_range("--resolution", self.resolution, 128, 8192)
        from mitex.methods.nerf.footage.making import make_capture

        report = make_capture(self.source, self.out, self.mask, self.frames, self.resolution)
        print(*report.lines(), self.out, sep="\n")
