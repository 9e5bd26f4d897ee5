"""Suffixes of files, which the library and, before it loads anything, the command line check."""

PICTURES = (".png", ".jpg", ".jpeg")
STILLS = (*PICTURES, ".exr")
VIDEOS = (".mp4", ".gif")
ASSETS = (".glb", ".obj", ".ply", ".exr", ".html")
FIELDS = (".npy", ".ply", ".json")  # of vectors
