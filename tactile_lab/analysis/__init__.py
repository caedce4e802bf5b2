"""What the data say: adaptation, transfer curve, rate against force, twin."""
