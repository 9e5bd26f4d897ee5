"""Textures that move along a vector field (MeshNCA, sections 4.3 and 5.3)."""
