"""The living page beside the way of MeshNCA's own page, in one browser."""
