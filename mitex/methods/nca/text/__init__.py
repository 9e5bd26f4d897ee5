"""Textures from words (MeshNCA, sections 4.2 and 5.2)."""
