"""Photos with masks and cameras."""
