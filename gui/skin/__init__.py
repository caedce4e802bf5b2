"""An array of sensors in a window of its own: as it is computed, and played."""
