"""Wires that bring bytes to far ends, and what may go wrong on them."""
