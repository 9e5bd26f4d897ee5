"""Learning a radiance field from a capture."""
