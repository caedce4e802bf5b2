"""The current source: ramps, limits, the guard that switches it off."""
