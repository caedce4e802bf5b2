"""The nouns and the one loop: no Qt, no wires, no simulated instruments."""
