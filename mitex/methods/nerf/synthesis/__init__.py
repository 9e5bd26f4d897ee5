"""More of a captured texture, in the plane."""
