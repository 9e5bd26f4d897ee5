"""Ranges of options, which the command line checks before it loads anything."""

DENSITIES = (0.001, 1000)  # factors of the density
LIFTS = (0, 1)  # from where the texture was captured, onto the mesh
SIZE = 2048  # side of a synthesized texture [texels], unless something else is said
