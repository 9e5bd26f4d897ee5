"""Ranges of options, which the command line checks before it loads anything."""

TILE_CELLS = (8, 1024)  # along a side of a tile
BAKED = (64, 8192)  # side of baked textures [texels]
REPEATS = 2  # of the exemplar along a flat square, unless something else is said
MOST_STEPS = 10_000  # of the automaton
SPEEDS = (0.0, 10.0)  # of a moving texture


def square_cells(density: float) -> int:
    """Cells along a flat square that shows an exemplar, `density` cells wide, `REPEATS` times."""
    low, high = TILE_CELLS
    return round(min(max(REPEATS * density, low), high))
