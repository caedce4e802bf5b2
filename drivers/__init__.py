"""One file per instrument family, one per wire."""
