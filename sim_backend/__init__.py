"""The far ends of the wires: the same drivers talk to computed physics."""
