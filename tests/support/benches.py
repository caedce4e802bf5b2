"""Bench files that tests of several rooms use."""

SERVED = """
name = "served"
simulated = false
[coil]
dialect = "patient.toml"
port = "{port}"
[magnet]
r = "6 mm"
"""
"""A current source behind a port, its row in `patient.toml` beside it."""

READ_BY_HAND = """
name = "read by hand"
simulated = true
[coil]
baud = 19200
[field_meter]
driver = "manual"
[magnet]
r = "6 mm"
"""
"""A simulated bench whose teslameter a person reads."""
