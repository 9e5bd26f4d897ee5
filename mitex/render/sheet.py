"""Contact sheets for galleries and previews."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mitex.errors import ConfigError
from mitex.images import to_bytes

GAP = 0.03  # between cells and around the sheet, of a cell's side
CAPTION = 0.09  # height of a label's line, of a cell's side
INK = (60, 60, 64)


def sheet(
    images: Sequence[np.ndarray],
    columns: int,
    labels: Sequence[str] | None = None,
    exemplar: np.ndarray | Sequence[np.ndarray] | None = None,
    cell: int | None = None,
) -> np.ndarray:
    """Pictures side by side on white.

    Args:
        images: (H, W, 3) sRGB in [0, 1] each; scaled to fit their cells.
        columns: pictures per row.
        labels: a caption below each picture.
        exemplar: what the textures were learned from: one image, or one per row, in a column of its own on
            the left.
        cell: side of a cell [px]; the largest picture's by default.

    Returns:
        (H, W, 3) float32 sRGB in [0, 1].

    Raises:
        ConfigError: no images, not one label per image, more exemplars than rows, a wrong shape, or a cell
            of no pixels.
    """
    if not images or columns < 1:
        raise ConfigError("a sheet needs images and columns", "give at least one of each")
    if labels is not None and len(labels) != len(images):
        raise ConfigError(f"{len(labels)} labels for {len(images)} images", "give one per image")
    if cell is not None and cell < 1:
        raise ConfigError(f"cells of {cell} pixels", "use 1 or more")
    exemplars = [] if exemplar is None else [exemplar] if isinstance(exemplar, np.ndarray) else list(exemplar)
    for image in (*images, *exemplars):
        if np.ndim(image) != 3 or image.shape[2] != 3 or not image.size:
            raise ConfigError(f"a picture has shape {np.shape(image)}", "give (H, W, 3)")
    columns = min(columns, len(images))
    rows = -(-len(images) // columns)
    if len(exemplars) > rows:
        raise ConfigError(f"{len(exemplars)} exemplars for {rows} rows", "give one, or one per row")
    side = cell or max(max(image.shape[:2]) for image in images)
    gap = max(2, round(GAP * side))
    line = round(CAPTION * side) if labels is not None else 0
    left = side + 3 * gap if exemplars else gap
    size = (left + columns * (side + gap), gap + rows * (side + line + gap))
    canvas = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(canvas)
    font = ImageFont.load_default(size=max(8.0, 0.7 * line)) if line else None
    for k, image in enumerate(images):
        row, column = divmod(k, columns)
        corner = (left + column * (side + gap), gap + row * (side + line + gap))
        _paste(canvas, image, corner, side)
        if labels is not None:
            place = (corner[0] + side / 2, corner[1] + side + line / 2)
            draw.text(place, labels[k], fill=INK, font=font, anchor="mm")
    for row, image in enumerate(exemplars):
        _paste(canvas, image, (gap, gap + row * (side + line + gap)), side)
    return np.asarray(canvas, np.float32) / np.float32(255.0)


def _paste(canvas: Image.Image, image: np.ndarray, corner: tuple[int, int], side: int) -> None:
    """Puts an image (H, W, 3) in the middle of the cell at a corner, scaled to fit."""
    picture = Image.fromarray(to_bytes(image))
    scale = side / max(picture.size)
    if scale != 1.0:
        fitted = tuple(max(1, round(n * scale)) for n in picture.size)
        picture = picture.resize((fitted[0], fitted[1]), Image.Resampling.LANCZOS)
    offset = tuple(c + (side - n) // 2 for c, n in zip(corner, picture.size, strict=True))
    canvas.paste(picture, (offset[0], offset[1]))
