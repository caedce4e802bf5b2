"""Spikes and circuits in the formats of neuromorphic software."""
