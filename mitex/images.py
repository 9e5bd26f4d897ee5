"""Reading and writing images: PNG and JPEG, checked before they are decoded."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image, ImageOps

from mitex.errors import ImageError
from mitex.paths import atomic_write, prepare_output
from mitex.suffixes import PICTURES as SUFFIXES

MAX_PIXELS = 64_000_000

# First bytes of what people rename to .png, so that the message can say what it really is.
_SIGNATURES = (
    (b"GIF8", "a GIF"),
    (b"II*\0", "a TIFF"),
    (b"MM\0*", "a TIFF"),
    (b"RIFF", "a WebP"),
    (b"BM", "a BMP"),
    (b"8BPS", "a Photoshop file"),
    (b"\x76\x2f\x31\x01", "an OpenEXR"),
    (b"#?RADIANCE", "a Radiance HDR"),
    (b"DDS ", "a DDS"),
    (b"%PDF", "a PDF"),
    (b"glTF", "a GLB mesh"),
    (b"<svg", "an SVG"),
)


def read_image(
    path: str | os.PathLike[str], mode: Literal["RGB", "L"] = "RGB", max_pixels: int = MAX_PIXELS
) -> np.ndarray:
    """Read a PNG or JPEG, values as stored (no colour conversion).

    The header is checked before anything is decoded, so a file that claims to be huge costs nothing. 16-bit
    grey keeps its precision; palettes, CMYK and grey are converted; the camera's orientation tag is obeyed;
    an alpha channel is dropped when it is opaque.

    Args:
        path: image file; what counts is its content, not its name.
        mode: "RGB" for three channels, "L" for one (the mean of the three if the file has colours).
        max_pixels: pixel budget, width times height.

    Returns:
        (H, W, 3) or (H, W, 1) float32 in [0, 1], row 0 on top.

    Raises:
        ImageError: missing, empty, not a PNG or JPEG, animated, over the budget, transparent, damaged.
    """
    pixels = _read(Path(path), max_pixels, _opaque)
    if mode == "L":
        return pixels.mean(axis=2, keepdims=True, dtype=np.float32)
    return pixels if pixels.shape[2] == 3 else pixels.repeat(3, axis=2)


def read_bytes(path: str | os.PathLike[str]) -> np.ndarray:
    """Read a PNG or JPEG with its alpha channel; otherwise as `read_image`.

    Returns:
        (H, W, 4) uint8, or (H, W, 3) from a file without alpha; straight alpha, row 0 on top.

    Raises:
        ImageError: missing, empty, not a PNG or JPEG, animated, over the budget, damaged.
    """
    return _read(Path(path), MAX_PIXELS, _bytes)


def write_image(path: str | os.PathLike[str], array: np.ndarray) -> Path:
    """Write an 8-bit PNG or JPEG (by suffix), atomically.

    Args:
        path: target, .png, .jpg or .jpeg.
        array: (H, W), (H, W, 1) or (H, W, 3), [0, 1]; clipped and rounded.

    Returns:
        The path written.

    Raises:
        OutputError: wrong suffix or unwritable place.
        ImageError: not an image array, or not finite.
    """
    path = prepare_output(path, suffixes=SUFFIXES)
    array = np.asarray(array)
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[:, :, 0]
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] != 3) or array.size == 0:
        raise ImageError(
            f"an array of shape {array.shape} is not an image", "pass (H, W), (H, W, 1) or (H, W, 3)"
        )
    if not np.isfinite(array).all():
        raise ImageError("the image holds NaN or infinite values", "check the step that made it")
    image = Image.fromarray(to_bytes(array))
    is_png = path.suffix.lower() == ".png"
    with atomic_write(path) as temporary:
        if is_png:
            image.save(temporary, format="PNG", optimize=True)
        else:
            image.save(temporary, format="JPEG", quality=92, subsampling=0)
    return path


def to_bytes(values: np.ndarray) -> np.ndarray:
    """Values in [0, 1] as uint8, clipped and rounded."""
    return np.round(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8)


def resize(array: np.ndarray, height: int, width: int) -> np.ndarray:
    """Resize (H, W, C) to (height, width, C) float32, antialiased bicubic, clipped to [0, 1]."""
    if array.shape[:2] == (height, width):
        return array
    channels = [
        np.asarray(Image.fromarray(plane).resize((width, height), Image.Resampling.BICUBIC))
        for plane in np.ascontiguousarray(np.moveaxis(array.astype(np.float32, copy=False), 2, 0))
    ]
    return np.clip(np.stack(channels, axis=2), 0.0, 1.0)


def bilinear(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Values of an image at points, interpolated linearly between the centres of its pixels.

    Args:
        image: (H, W, C), row 0 on top.
        uv: (P, 2), u to the right and v upwards; outside of [0, 1] the border counts.

    Returns:
        (P, C).
    """
    size = np.array([image.shape[1], image.shape[0]])
    place = (np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1) * size - 0.5).clip(0, size - 1)
    corner = np.minimum(place.astype(np.int64), np.maximum(size - 2, 0))
    (column, row), (x, y) = corner.T, (place - corner).T[:, :, None]
    right, below = np.minimum(column + 1, size[0] - 1), np.minimum(row + 1, size[1] - 1)
    upper = (1 - x) * image[row, column] + x * image[row, right]
    return (1 - y) * upper + y * ((1 - x) * image[below, column] + x * image[below, right])


def _open(path: Path, max_pixels: int) -> Image.Image:
    """Open lazily: Pillow reads the header only."""
    _check_file(path)
    try:
        image = Image.open(path, formats=("PNG", "JPEG"))
    except Image.DecompressionBombError as error:
        raise _too_large(path, "far", max_pixels) from error
    except Exception as error:  # decoders raise anything from SyntaxError to struct.error on hostile bytes
        raise ImageError(f"{path} {_what_it_is(path)}", "give a PNG or JPEG file") from error
    width, height = image.size
    if width < 1 or height < 1:
        raise ImageError(f"{path} has no pixels ({width} x {height})", "save the image again")
    if width * height > max_pixels:
        raise _too_large(path, f"{width} x {height} pixels,", max_pixels)
    if image.format == "PNG" and getattr(image, "is_animated", False):
        raise ImageError(f"{path} is animated", "save one frame of it as a PNG")
    return image


def _check_file(path: Path) -> None:
    if os.path.isdir(path):
        raise ImageError(f"{path} is a folder, not an image", "give a PNG or JPEG file")
    if not os.path.exists(path):
        raise ImageError(f"{path} does not exist", "check the path of the image")
    if not path.is_file():
        raise ImageError(f"{path} is not a regular file", "give a PNG or JPEG file")
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise ImageError(f"{path} cannot be read ({error.strerror})", "check its permissions") from error
    if empty:
        raise ImageError(f"{path} is empty", "save or download the image again")


def _too_large(path: Path, size: str, max_pixels: int) -> ImageError:
    budget = f"{max_pixels / 1e6:.0f} megapixels" if max_pixels >= 1e6 else f"{max_pixels} pixels"
    return ImageError(
        f"{path} is {size} over the limit of {budget}", "scale it down; 256 to 1024 pixels are plenty"
    )


def _what_it_is(path: Path) -> str:
    with path.open("rb") as file:
        start = file.read(16)
    for signature, name in _SIGNATURES:
        if start.startswith(signature):
            return f"is {name}, not a PNG or JPEG"
    if start.startswith((b"\x89PNG", b"\xff\xd8")):
        return "has a damaged header"
    return "is not an image"


def _read(path: Path, max_pixels: int, convert: Callable[[Image.Image, Path], np.ndarray]) -> np.ndarray:
    """Check, decode, turn upright and convert."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow's own size warning; the budget is stricter
        with _open(path, max_pixels) as image:
            try:
                image.load()
                return convert(ImageOps.exif_transpose(image), path)
            except ImageError:
                raise
            except MemoryError as error:
                raise ImageError(f"{path} does not fit in memory", "scale the image down") from error
            except Exception as error:  # see _open
                raise ImageError(
                    f"{path} is damaged or cut short", "save or download the image again"
                ) from error


def _opaque(image: Image.Image, path: Path) -> np.ndarray:
    """Pixels as (H, W, 1 or 3) float32 in [0, 1]."""
    if image.mode.startswith("I"):  # 16-bit grey
        return np.asarray(image).astype(np.float32)[:, :, None] / 65535.0
    if image.has_transparency_data:
        image = image.convert("RGBA")
        _check_opaque(image, path)
    image = image.convert("L" if image.mode in ("1", "L") else "RGB")
    pixels = np.asarray(image, dtype=np.float32) / np.float32(255.0)
    return pixels if pixels.ndim == 3 else pixels[:, :, None]


def _bytes(image: Image.Image, path: Path) -> np.ndarray:
    """Pixels as (H, W, 3 or 4) uint8."""
    if image.mode.startswith("I"):
        grey = np.round(np.asarray(image).astype(np.float32) / 257.0).astype(np.uint8)
        return grey[:, :, None].repeat(3, axis=2)
    return np.array(image.convert("RGBA" if image.has_transparency_data else "RGB"))


def _check_opaque(image: Image.Image, path: Path) -> None:
    lowest = image.getchannel("A").getextrema()[0]
    if isinstance(lowest, (int, float)) and lowest < 250:
        # What lies under transparent pixels is arbitrary: dropping alpha would teach the model junk colours.
        raise ImageError(
            f"{path} has transparent pixels", "flatten it onto a background or crop to the opaque part"
        )
