"""The far end of a PicoScope: its vendor's functions."""
