"""Range of an option, which the command line checks before it loads anything."""

MOST_STEPS = 10_000  # of a texture on a mesh
