"""Ranges of options, which the command line checks before it loads anything."""

SPACINGS = (0.1, 2)  # between anchors [sides of a box]
TILTS = (0, 45)  # of the boxes [degrees]
