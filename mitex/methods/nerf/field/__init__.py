"""The radiance field in the shell around a base shape."""
