"""Ranges of options, which the command line checks before it loads anything."""

TILE_CELLS = (8, 1024)  # along a side of a tile
TILE_SIDES = (16, 8192)  # of its maps [px]
MOST_STEPS = 10_000  # of the automaton
