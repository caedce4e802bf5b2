"""The NESTML model of a circuit, compiled into NEST: how far its spikes are from ours.

    python tests/benchmarks/nestml_nest.py --python ENVIRONMENT/bin/python

ENVIRONMENT has `pip install nest-simulator NESTML`; a C++ compiler, cmake and the
headers of GSL and boost are needed (Debian: g++ cmake libgsl-dev libboost-dev). NEST's
wheel was built elsewhere and for the older C++ strings: its `nest-config` is copied and
corrected. Takes some 30 s of processor time for each circuit; the exit code is 1 where
a spike is missing or one too many.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from tactile_lab.model.circuit import Circuit
from tactile_lab.neuro.circuits import write
from tactile_lab.neuro.solved import Solved
from tactile_lab.waveform import Waveform

HELD = np.array([0.0, 0.1, 0.15, 10.15, 10.2, 10.5])
"""Rest, ramp, hold, ramp, rest: s."""
CASES = {
    "Table 1, 150 mN": (Circuit(), 0.15),
    'firing = "put", 150 mN': (Circuit(firing="put"), 0.15),
    't1 = "direct", 15 mN': (Circuit(t1="direct", I_T1s=2.873e-20), 0.015),
}
COMPILE = """
import re, sys
from pathlib import Path
import nest
from pynestml.frontend.pynestml_frontend import generate_nest_target
installed = Path(nest.__file__).parent
prefix = Path("prefix")
(prefix / "bin").mkdir(parents=True, exist_ok=True)
scripts = Path(sys.executable).parent, installed.parent / "bin"
original = next(f / "nest-config" for f in scripts if (f / "nest-config").exists())
text = original.read_text()
built = re.search(r'^prefix="?([^"\\n]*)', text, re.M)[1]
text = text.replace(built, str(installed))
text = re.sub(r'"/[^"]*/g\\+\\+"', '"g++"', text)
text = text.replace("-std=", "-D_GLIBCXX_USE_CXX11_ABI=0 -std=")
text = re.sub(r'"-L[^"]*libgomp.so *"', '"-lgsl -lgslcblas -lgomp"', text)
config = prefix / "bin" / "nest-config"
config.write_text(text)
config.chmod(0o755)
generate_nest_target(
    "sensor.nestml", target_path="target", install_path=str(Path("module").absolute()),
    module_name="sensormodule", logging_level="ERROR",
    codegen_opts={
        "nest_version": f"v{nest.__version__}", "nest_path": str(prefix.absolute()),
    },
)
"""
PLAY = """
import sys
import nest, numpy as np
given, step = np.load("sensor.force.npz"), 0.1
nest.resolution = step
nest.Install("sensormodule")
sensor, heard = nest.Create("tactile_sensor"), nest.Create("spike_recorder")
begin = np.maximum(np.round(given["time"][:-1] * 1e3, 6), step)  # none at 0 in NEST
slope = np.diff(given["force"]) / np.diff(given["time"]) * 1e3  # 1 pA for 1 mN/s
push = nest.Create("step_current_generator", params={
    "amplitude_times": begin, "amplitude_values": slope})
watch = nest.Create("multimeter", params={"record_from": ["late"], "interval": step})
nest.Connect(push, sensor, syn_spec={"delay": step})
nest.Connect(sensor, heard)
nest.Connect(watch, sensor)
nest.Simulate(float(given["duration"]) * 1e3 + 1)
told, late = np.array(heard.events["times"]), np.array(watch.events["late"])
at = np.searchsorted(np.array(watch.events["times"]), told - step / 2)
# the current arrives one step late
np.save("theirs.npy", (told - late[at] - step) / 1e3)
"""


def main() -> int:
    """Compile and run each circuit, and print a table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--python", required=True)
    python = str(Path(options.parse_args().python).absolute())
    print("| circuit | spikes | theirs | times apart at most |\n|---|---|---|---|")
    same = True
    for name, (circuit, most) in CASES.items():
        force = Waveform(HELD, most * np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0]))
        solved = Solved.of(circuit, force, float(HELD[-1]))
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            write(solved, folder / "sensor.nestml")
            (folder / "module").mkdir()
            env = {**os.environ, "LD_LIBRARY_PATH": str(folder / "module")}
            for text in (COMPILE, PLAY):
                done = subprocess.run(
                    [python, "-c", text], cwd=folder, env=env, capture_output=True,
                    text=True,
                )  # fmt: skip
                if done.returncode:
                    raise SystemExit(
                        f"{name}: {done.stdout[-3000:]}{done.stderr[-3000:]}"
                    )
            theirs = np.load(folder / "theirs.npy")
        ours, apart = solved.spikes, "-"
        if theirs.size == ours.size:
            apart = f"{1e6 * np.abs(theirs - ours).max():.1f} µs"
        same = same and theirs.size == ours.size
        print(f"| {name} | {ours.size} | {theirs.size} | {apart} |", flush=True)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
