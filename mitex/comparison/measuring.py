"""Measuring one result: its patches beside the exemplar's, its seams, its pictures. What is known is kept."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from safetensors import safe_open

from mitex.asset import Asset
from mitex.cache import content_key
from mitex.comparison.results import Result
from mitex.errors import ImageError
from mitex.evaluation.likeness import Vectors, exemplar_patches, likeness, patch_features
from mitex.evaluation.patches import albedo_views, patch_cameras
from mitex.evaluation.regularity import regularity
from mitex.evaluation.seams import seam_ratio
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import Mesh
from mitex.methods.layout import EXEMPLAR_WIDTH, RESOLUTION, layout_side, with_layout
from mitex.paths import atomic_write
from mitex.render.picture import AZIMUTH, ELEVATION, tone
from mitex.render.renderer import OrbitRenderer
from mitex.training.locate import CHECKPOINT

log = logging.getLogger(__name__)

SIDE = 256  # of the exemplar, at most [px]
PATCHES, SHARE = 16, 0.375  # patches, and their width [widths of the exemplar]
WINDOWS = 6  # as wide as the exemplar, for the repetition
CELL, SPP = 384, 64  # side of a picture [px], and rays of each pixel
SETTINGS = {"version": 1, "patches": PATCHES, "share": SHARE, "windows": WINDOWS, "cell": CELL, "spp": SPP}
OPTIMIZED = ("optimizer/first/", "optimizer/point")  # tensors of a checkpoint, as large as what is optimized


class Target:
    """An exemplar, as results are compared with it.

    Attributes:
        image: (S, S, 3) its albedo's central square, sRGB in [0, 1].
    """

    def __init__(self, exemplar: str) -> None:
        source = Exemplar.load(exemplar).of_albedo()
        self.image = source.resized(min(SIDE, *source.size)).maps["albedo"]

    @property
    def pixels(self) -> int:
        """Along a patch."""
        return round(SHARE * len(self.image))

    @cached_property
    def features(self) -> Vectors:
        """Those of its patches."""
        return patch_features(exemplar_patches(self.image, PATCHES, self.pixels))

    @cached_property
    def regularity(self) -> float:
        """How regularly it repeats."""
        return regularity(self.image)

    @property
    def key(self) -> str:
        """A hash of the image."""
        return content_key(self.image)

    def floor(self) -> dict[str, float]:
        """The distances of other patches of the exemplar: what is the least to be expected."""
        others = exemplar_patches(self.image, PATCHES, self.pixels, seed=1)
        return asdict(likeness(patch_features(others), self.features))


class Place:
    """A mesh, and the cameras that all results on it are seen by."""

    def __init__(self, mesh: str) -> None:
        self.mesh = Mesh.load(mesh)

    @cached_property
    def width(self) -> float:
        """Of the exemplar on the mesh [mesh units]."""
        return EXEMPLAR_WIDTH * layout_side(with_layout(self.mesh, RESOLUTION))

    def numbers(self, asset: Asset, target: Target) -> dict[str, float]:
        """What is measured of an asset; NaN, or nothing, where that is not possible."""
        wide = patch_cameras(self.mesh, WINDOWS, self.width, len(target.image))
        order = np.mean([regularity(*view) for view in zip(*albedo_views(asset, wide), strict=True)])
        return {
            **self._likeness(asset, target),
            "seams": seam_ratio(asset, self.width / len(target.image)),
            "repetition": float(order) - target.regularity,
        }

    def _likeness(self, asset: Asset, target: Target) -> dict[str, float]:
        """Distances of patches; none on a mesh so thin that they show too little of it."""
        near = patch_cameras(self.mesh, PATCHES, SHARE * self.width, target.pixels)
        try:
            return asdict(likeness(patch_features(albedo_views(asset, near)), target.features))
        except ImageError as e:
            log.info("%s: %s", self.mesh.name, e)
            return {}

    def picture(self, asset: Asset) -> np.ndarray:
        """(CELL, CELL, 3) the asset in light, path-traced."""
        renderer = OrbitRenderer(asset, resolution=CELL, like=self.mesh)
        return tone(renderer.render(AZIMUTH, renderer.fit_view(AZIMUTH, ELEVATION), SPP))


class Kept:
    """What was measured before, in a folder: a JSON file and a picture for each result."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def completed(self, result: Result) -> Result | None:
        """The result with what is known of it; None if that is not all."""
        picture, numbers = self._file(result, ".jpg"), _read(self._file(result, ".json"))
        return None if numbers is None or not picture.is_file() else _with(result, numbers, picture)

    def measured(self, result: Result, place: Place, target: Target) -> Result:
        """The result, measured now and kept.

        Raises:
            MitexError: The asset cannot be read or measured, or the disk is full.
        """
        asset = Asset.load(result.asset)
        numbers = place.numbers(asset, target) | {"parameters": optimized_numbers(result.run)}
        known = {key: value for key, value in numbers.items() if math.isfinite(value)}
        picture = write_image(self._file(result, ".jpg"), place.picture(asset))
        _write(self._file(result, ".json"), known)
        return _with(result, known, picture)

    def floor(self, target: Target) -> dict[str, float]:
        """That of an exemplar."""
        path = self.folder / f"exemplar-{target.key}.json"
        if (known := _read(path)) is None:
            known = target.floor()
            _write(path, known)
        return known

    def _file(self, result: Result, suffix: str) -> Path:
        return self.folder / f"{result.id}{suffix}"


def optimized_numbers(run: Path) -> int:
    """How many numbers a fit has optimized, by its checkpoint; 0 without one."""
    path = run / CHECKPOINT
    if not path.is_file():
        return 0
    with safe_open(path, framework="pt") as file:
        names: Iterable[str] = [name for name in file.keys() if name.startswith(OPTIMIZED)]  # noqa: SIM118
        return sum(math.prod(file.get_slice(name).get_shape()) for name in names)


def _read(path: Path) -> dict[str, float] | None:
    """Numbers that were kept; None if there are none, or if they were measured with other settings."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if record["settings"] != SETTINGS:
            return None
        return {key: float(value) for key, value in record["numbers"].items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None


def _write(path: Path, numbers: Mapping[str, float]) -> None:
    record = {"settings": SETTINGS, "numbers": dict(numbers)}
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _with(result: Result, numbers: dict[str, float], picture: Path) -> Result:
    return replace(result, numbers={**result.numbers, **numbers}, pictures={"picture": picture})
