"""From a video or photos to the folder of a capture."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mitex.errors import CaptureError, OutputError
from mitex.images import read_bytes, write_image
from mitex.methods.checks import in_range
from mitex.methods.nerf.capture.capture import MIN_VIEWS, load_capture
from mitex.methods.nerf.capture.transforms import ONE_FILE, Frame
from mitex.methods.nerf.footage.coverage import advice
from mitex.methods.nerf.footage.mask_method import mask_method
from mitex.methods.nerf.footage.pictures import Footage, footage
from mitex.methods.nerf.footage.sharpest import blurred_photos, faults, reasons, sharpest
from mitex.methods.nerf.footage.site import Site, find_site
from mitex.optional import optional
from mitex.paths import check_writable, expanded, missing_folders, writing
from mitex.progress import counted
from mitex.records import write_json

FRAMES, RESOLUTION = 80, 1600


@dataclass(frozen=True)
class Report:
    """What became of the pictures.

    Attributes:
        given: frames of the video, or photos.
        sharp: that were picked.
        reasons: why others were not, in words.
        placed: that have a camera.
        masked: that have a mask, and are in the capture.
        advice: what to film again, one sentence each.
    """

    given: int
    sharp: int
    reasons: str
    placed: int
    masked: int
    advice: Sequence[str]

    def lines(self) -> list[str]:
        """The report in words."""
        left_out = f" ({self.reasons})" if self.reasons else ""
        again = (
            "" if self.placed > 0.9 * self.sharp else "; move more slowly, and turn less from one to the next"
        )
        return [
            f"{self.sharp} of {self.given} pictures picked{left_out}",
            f"{self.placed} of them got a camera{again}",
            f"{self.masked} of those got a mask",
            *(self.advice or ["all sides were filmed"]),
        ]


def make_capture(
    source: str | Path,
    out: str | Path,
    mask: str = "plane",
    frames: int = FRAMES,
    resolution: int = RESOLUTION,
) -> Report:
    """Makes a capture of a video or of a folder of photos, in the layout that `load_capture` reads.

    Args:
        source: a video of an object that stands still, or photos of it.
        out: folder to be made; it appears when it is complete.
        mask: how the object is told from its surroundings, as `mask_method` reads it.
        frames: pictures to pick, at most, 8 to 1000.
        resolution: longer side of the pictures in the capture, at most [pixels].

    Raises:
        CaptureError: no video or photos, too few that are sharp, have a camera or a mask.
        ConfigError: an option out of range.
        ImageError: a photo is damaged, or has a side below 16 pixels.
        MissingPackage: the extra `nerf` is not installed.
        OutputError: `out` exists, or cannot be written.
        WeightsError: the network that is to mask cannot be used.
    """
    in_range("`frames`", frames, MIN_VIEWS, 1000)
    in_range("`resolution`", resolution, 128, 8192)
    method = mask_method(mask)
    cut_out = optional("mitex.methods.nerf.footage.cutting", "nerf").cut_out
    network = None
    if method.network is not None:
        network = optional("mitex.methods.nerf.footage.network", "nerf").read_network(method.network)
    with _new_folder(expanded(out), expanded(source)) as folder:
        taken = footage(source, resolution)
        names, why = _picked(taken, frames, folder)
        site = find_site(folder, names)
        if method.kind == "box" and site.frames[0].name != names[0]:
            raise CaptureError("the first picture, which the box is in, got no camera", "mask in another way")
        masks = cut_out(site, [read_bytes(frame.image) for frame in site.frames], method, network)
        kept = [k for k, one in enumerate(masks) if one.any()]
        if len(kept) < MIN_VIEWS:
            raise CaptureError(
                f"only {len(kept)} of {len(masks)} pictures could be masked", "mask the object in another way"
            )
        _write(folder, site, masks, kept)
        views = [replace(site.views[k], mask=masks[k]) for k in kept]
        middle = load_capture(folder).similarity.inverse(np.zeros((1, 3)))[0]  # and so it is sure to load
        return Report(taken.count, len(names), why, len(masks), len(kept), advice(views, middle))


def _picked(taken: Footage, frames: int, folder: Path) -> tuple[list[str], str]:
    """Writes the pictures to work with; their names, and why others were left out, in words.

    The first picture is one of them, since a box would be in it: no way to mask asks for cameras of its own.
    """
    images, qualities = [], []
    parts = min(frames, taken.count)
    work = counted("picking sharp pictures", sharpest(taken.read(), taken.count, parts), parts)
    for picture, quality in work:
        name = f"images/{picture.name}.jpg"
        write_image(folder / name, picture.pixels.astype(np.float32) / 255.0)
        images.append(name)
        qualities.append(quality)
    verdicts = (faults if taken.video else blurred_photos)(qualities)
    verdicts[:1] = [""]
    names = [name for name, verdict in zip(images, verdicts, strict=True) if not verdict]
    why = reasons(verdicts)
    if len(names) < MIN_VIEWS:
        raise CaptureError(
            f"{taken.source} has {len(names)} pictures to work with{f' ({why})' if why else ''}",
            "film for half a minute, slowly, all around the object, with the exposure locked",
        )
    for name in set(images) - set(names):
        (folder / name).unlink()
    return names, why


def _write(folder: Path, site: Site, masks: Sequence[np.ndarray], kept: Sequence[int]) -> None:
    """Masks and cameras; pictures that have neither go."""
    frames = [site.frames[k] for k in kept]
    for k in kept:
        write_image(folder / "masks" / f"{site.frames[k].image.stem}.png", masks[k].astype(np.float32))
    tree = {"camera_model": "OPENCV", "frames": [_entry(frame) for frame in frames]}
    write_json(folder / ONE_FILE, tree)
    images = {frame.image.name for frame in frames}
    for path in (folder / "images").iterdir():
        if path.name not in images:
            path.unlink()


def _entry(frame: Frame) -> dict[str, object]:
    lens = {key: value for key, value in frame.lens.items() if key not in ("file_path", "camera_model")}
    return {
        "file_path": frame.name,
        "mask_path": f"masks/{frame.image.stem}.png",
        **lens,
        "transform_matrix": [*frame.pose.tolist(), [0.0, 0.0, 0.0, 1.0]],
    }


@contextmanager
def _new_folder(out: Path, source: Path) -> Iterator[Path]:
    """A folder to fill, which becomes `out` when all went well and is removed otherwise."""
    check_writable(out)
    out = Path(os.path.realpath(out))  # through a link, which stays
    with writing(out), suppress(FileNotFoundError):
        out.lstat()  # also finds a name that is too long
        if not out.is_dir() or any(out.iterdir()):
            raise OutputError(f"'{out}' exists", "name a new folder")
    if out == Path.cwd():  # would be gone for who works in it
        raise OutputError(f"'{out}' is the current folder", "name a new one")
    if out.is_relative_to(source.resolve()):
        raise OutputError(f"'{out}' is among the photos", "name a folder elsewhere")
    created = missing_folders(out.parent)
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        filling = Path(tempfile.mkdtemp(prefix=".filling-", dir=out.parent))
    try:
        yield filling
        with writing(out):
            filling.chmod(0o777 & ~_umask())
            os.replace(filling, out)
    except BaseException:
        shutil.rmtree(filling, ignore_errors=True)
        for folder in reversed(created):
            with suppress(OSError):
                folder.rmdir()
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
