"""A run on disk: written, read back, checked, recovered, exported."""
