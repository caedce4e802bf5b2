"""Verbs of the command line that speak to what is attached."""
