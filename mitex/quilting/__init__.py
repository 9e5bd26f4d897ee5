"""Textures joined from patches of others: in the plane, on surfaces, and on a square that repeats."""
