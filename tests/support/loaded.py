"""What one command line loads, in a process of its own; run it to print the lists."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from sim_backend.serve import ServedBench

OURS = ("tactile_lab", "drivers", "sim_backend", "protocols", "gui")

WATCHED = """
import contextlib, io, json, sys
from tactile_lab.cli import main
with contextlib.redirect_stdout(io.StringIO()):
    try: main(sys.argv[1:])
    except SystemExit as end: assert end.code == 0, end.code
print(json.dumps(sorted(sys.modules)))
"""

FORCE_ONLY = """
[protocol]
name = "pulses"
levels = ["10 mN"]
ramp = "50 ms"
hold = "0.1 s"
rest = "50 ms"
[record]
signals = ["force"]
"""

BENCH = """
name = "all there is"
[coil]
port = "{port}"
[scope]
driver = "usbtmc"
[[scope.channels]]
signal = "V_K"
input = "1"
range = "4 V"
[field_meter]
port = "/dev/never-there"
[magnet]
r = "6 mm"
"""


def loaded_after(*arguments: str, folder: Path | None = None) -> set[str]:
    """Modules loaded by one command line, which must end well, run in `folder`."""
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, *arguments],
        cwd=folder,
        env=os.environ | ({"XDG_STATE_HOME": str(folder)} if folder else {}),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


def force_only(folder: Path) -> set[str]:
    """After a run that only drives a coil source, on a bench that has everything."""
    served = ServedBench(coil="pty", paced=True)
    served.start()
    try:
        (folder / "bench.toml").write_text(BENCH.format(port=served.addresses["coil"]))
        (folder / "force.toml").write_text(FORCE_ONLY)
        return loaded_after(
            *("run", "force.toml", "--bench", "bench.toml", "--no-report"),
            folder=folder,
        )
    finally:
        served.close()


def force_simulated(folder: Path) -> set[str]:
    """After a run that only drives the simulated coil, and its report."""
    (folder / "force.toml").write_text(FORCE_ONLY)
    return loaded_after("run", "force.toml", folder=folder)


def spikes_only(folder: Path) -> set[str]:
    """After a run that only detects spikes, on the simulated bench."""
    return loaded_after("run", "spikes_only", "--no-report", folder=folder)


def simulated(folder: Path) -> set[str]:
    """After the model alone."""
    return loaded_after("simulate", "spikes_only", folder=folder)


def main() -> None:
    """Print the lists, as counts."""
    for which in (force_only, force_simulated, spikes_only, simulated):
        with tempfile.TemporaryDirectory() as folder:
            names = which(Path(folder))
        rooms = Counter(name.partition(".")[0] for name in names)
        ours = {room: rooms[room] for room in OURS if rooms[room]}
        others = sorted(
            top
            for top in rooms
            if top not in OURS
            and top not in sys.stdlib_module_names
            and not top.startswith("_")
        )
        print(f"{which.__name__}: {sum(ours.values())} of ours {ours}")
        print(f"  {len(others)} others: {', '.join(others)}")


if __name__ == "__main__":
    main()
