"""Figures, tables and the self-contained report of a run."""
