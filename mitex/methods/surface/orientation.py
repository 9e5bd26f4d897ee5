"""An orientation field of the user's: where the exemplar's right shall point, given at the vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.paths import expanded


def read_orientation(path: str | Path, mesh: Mesh) -> np.ndarray:
    """Reads a field from a NumPy file.

    Args:
        path: .npy with (V, 3) numbers, a vector of any length for each vertex, zero where it does not matter.
        mesh: whose vertices they belong to.

    Returns:
        (V, 3) float32.

    Raises:
        ConfigError: no such file, not an array of numbers, of another shape, or not finite.
    """
    place = expanded(path)
    if not place.is_file():
        raise ConfigError(f"there is no orientation field at '{place}'", "give a .npy file")
    try:
        # Mapped: a header that claims more than there is fails before anything is allocated.
        field = np.load(place, mmap_mode="r", allow_pickle=False)
    except (ValueError, OSError, EOFError) as e:
        raise ConfigError(f"'{place}' is not a NumPy array ({e})", "write it with numpy.save") from e
    shape = (len(mesh.vertices), 3)
    if not isinstance(field, np.ndarray) or field.shape != shape or field.dtype.kind not in "fiu":
        content = f"{field.dtype} {field.shape}" if isinstance(field, np.ndarray) else "an archive"
        raise ConfigError(
            f"the orientation field in '{place}' is {content}",
            f"give numbers of shape {shape}, a vector for each vertex of '{mesh.name}'",
        )
    values = np.array(field, np.float32)
    if not np.isfinite(values).all():
        raise ConfigError(f"'{place}' has NaN or infinite entries", "use zeros where the field is unknown")
    return values
