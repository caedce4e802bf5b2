"""The right panel: results, runs, manual control."""
