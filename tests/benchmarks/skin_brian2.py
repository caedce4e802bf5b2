"""An array of circuits in Brian2's C++ standalone: run by `skin_speed.py`.

Reads the .npz named first, writes spikes and time spent to the second; the third word
is the step in s. Equations and the location of spikes are those of `simulate --export`.
"""

import sys
import tempfile

import numpy as np
from brian2 import (
    Network,
    NeuronGroup,
    SpikeMonitor,
    TimedArray,
    amp,
    device,
    farad,
    ohm,
    prefs,
    second,
    set_device,
    volt,
)

UNITS = {
    "I_S": amp, "I_T1s": amp, "V_GS": volt, "V_T": volt, "V_S": volt, "V_fire": volt,
    "m": None, "tau": second, "tau_L": second, "R1": ohm, "R2": ohm, "R3": ohm,
    "R_L": ohm, "C1": farad, "C2": farad,
}  # fmt: skip

data, out, step = np.load(sys.argv[1]), sys.argv[2], float(sys.argv[3])
set_device("cpp_standalone", build_on_run=False)
prefs.codegen.cpp.extra_compile_args_gcc = ["-O3", "-march=native", "-std=c++11"]
steps = int(np.ceil(float(data["duration"]) / step))
count = data["V_C1"].size
grid = np.arange(steps + 1) * step
ends = np.cumsum(data["points"])
slopes = np.empty((steps, count))
for taxel, end in enumerate(ends):
    part = slice(end - data["points"][taxel], end)
    V = data["k_F"][taxel] * np.interp(grid, data["time"][part], data["force"][part])
    slopes[:, taxel] = np.diff(V) / step
slope_of = TimedArray(slopes * volt / second, dt=step * second)
declared = "\n".join(
    f"{name} : {1 if unit is None else unit.name} (constant)"
    for name, unit in UNITS.items()
)
sensors = NeuronGroup(
    count,
    """
    dV_P/dt = slope - V_P/tau : volt
    slope = slope_of(t, i) : volt/second (constant over dt)
    I_DS = -I_S*exp((V_GS + V_P)/(m*V_T))*expm1(-V_C1/V_T) : amp
    slope_of_V_C1 = ((V_S - V_C1)/R1 - V_C1/R2 - I_DS)/C1 : volt/second
    dV_C1/dt = slope_of_V_C1 : volt
    dI_C/dt = -slope_of_V_C1*(I_C + I_T1s)/(R3*(I_C + I_T1s) + V_T) : amp
    Q = R_L*I_C : volt
    dV_C2/dt = (Q - V_C2)/tau_L : volt
    late = clip(tau_L*(V_C2 - V_fire)/(Q - V_C2), 0*second, dt) : second
    t_fire = t + dt - late : second
    """
    + declared,
    threshold="V_C2 >= V_fire",
    reset="V_C2 = Q*(1 - exp(-late/tau_L))",
    method="rk4",
    dt=step * second,
)
for name, unit in UNITS.items():
    setattr(sensors, name, data[name] if unit is None else data[name] * unit)
for name, unit in (("V_C1", volt), ("I_C", amp), ("V_C2", volt)):
    setattr(sensors, name, data[name] * unit)
spikes = SpikeMonitor(sensors, variables="t_fire")
network = Network(sensors, spikes)
network.run(steps * step * second)
with tempfile.TemporaryDirectory() as folder:
    device.build(directory=folder, compile=True, run=True)
    np.savez(
        out, taxel=np.asarray(spikes.i), time=np.asarray(spikes.t_fire / second),
        spent=device._last_run_time,
    )  # fmt: skip
