"""The circuit model of the paper: pure maths, no I/O."""
