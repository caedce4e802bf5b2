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

WITH_GAPS = """
name = "bench scope"
simulated = true
[coil]
baud = 19200
[scope]
driver = "usbtmc"
[[scope.channels]]
signal = "V_C1"
input = "1"
range = "4 V"
offset = "-2.5 V"
[[scope.channels]]
signal = "V_K"
input = "2"
range = "8 V"
[[scope.channels]]
signal = "coil_current"
input = "3"
range = "200 mV"
shunt = "0.1 Ohm"
[magnet]
r = "6 mm"
"""
"""A simulated bench whose oscilloscope polls: one record, then blind until the next."""
