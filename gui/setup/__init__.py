"""The left panel: what the next run will do."""
