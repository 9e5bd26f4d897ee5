"""Suffixes of files, which the library and, before it loads anything, the command line check."""

from pathlib import Path

PICTURES = (".png", ".jpg", ".jpeg")
STILLS = (*PICTURES, ".exr")
VIDEOS = (".mp4", ".gif")
ASSETS = (".glb", ".obj", ".ply", ".exr", ".html")
FIELDS = (".npy", ".ply", ".json")  # of vectors


def names_field_file(field: object) -> bool:
    """Whether what a vector field is given by names a file of vectors."""
    return isinstance(field, str | Path) and Path(field).suffix.lower() in FIELDS
