"""Range and default of an option, which the command line needs before it loads anything."""

STEPS = 500  # of time, after which patterns are in order
MOST_STEPS = 10_000  # of a texture on a mesh
