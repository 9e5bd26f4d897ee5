"""What a page shows, before it is a document."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mitex.images import to_bytes
from mitex.page.document import data_url, document
from mitex.paths import atomic_write

QUALITY = 82  # of JPEGs


@dataclass(frozen=True)
class Content:
    """What a page shows.

    Attributes:
        title: of the document.
        data: what its scripts read, as JSON values.
        picture: JPEG for browsers without WebGL2; empty for none.
    """

    title: str
    data: Mapping[str, Any]
    picture: bytes = b""

    def html(self) -> str:
        """The document."""
        return document(self.title, self.data, self.picture)

    def write(self, path: Path) -> Path:
        """Writes the document to a file.

        Raises:
            OutputError: the place is not writable.
        """
        text = self.html()
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        return path

    def extended(self, **values: Any) -> Content:
        """The same with further data."""
        return replace(self, data={**self.data, **values})


def jpeg(picture: np.ndarray, quality: int = QUALITY) -> bytes:
    """A picture (H, W, 3), sRGB in [0, 1], as the bytes of a JPEG file."""
    buffer = io.BytesIO()
    Image.fromarray(to_bytes(picture)).save(buffer, "JPEG", quality=quality)
    return buffer.getvalue()


def thumbnail(path: Path, side: int) -> str:
    """A picture file as the address of a small JPEG, which holds it."""
    with Image.open(path) as image:
        small = image.convert("RGB").resize((side, side), Image.Resampling.LANCZOS)
    return data_url(jpeg(np.asarray(small, np.float32) / 255))
