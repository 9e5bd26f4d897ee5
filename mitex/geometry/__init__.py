"""Geometry of arrays: vectors, triangles, tangents and normal maps, and the raster of a UV layout."""
