"""Have what is compiled on its first use compiled, once, before the tests begin.

    python tests/support/compile_once.py

Each worker of the tests would compile for itself what no other has kept yet, and each
would rewrite the assertions of every test. This is done while another process checks
the types, and in two: those are done long before one would have compiled all.
"""

import gc
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tactile_lab.cli import cli
from tactile_lab.skin.single import simulate_taxel
from tactile_lab.skin.skin import load_skin

ROOT = Path(__file__).parents[2]

SKIN = """
duration = "0.1 s"
[sensor]
preset = "table1"
{saturation}
[array]
grid = [2, 2]
[[stimulus]]
kind = "sphere"
force = "3 N"
"""
STUDY = """
scene = "hold_10s"
on = "model"
keep = ["spike_count"]
[[axis]]
key = "protocol.level"
values = ["80 mN", "160 mN"]
"""
SKINS = {"plain.toml": "", "saturated.toml": "saturation = true"}
COMMANDS = {
    "circuit": (
        ("run", "demo", "--set", "protocol.hold=0.2 s"),
        ("study", "sweep.toml"),
        ("validate", "stability", "--case", "R_k", "--cap", "0.01"),
    ),
    "skin": (
        ("simulate", "--set", "sensor.saturation=true"),
        *(("skin", name) for name in reversed(SKINS)),
    ),
}
"""Side by side, in an order in which neither waits for what the other has compiled.

Each finds the other's solver on the disk by the time that it needs it.
"""


def compile_all(commands: str) -> None:
    """Run one command after another in a folder then removed."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        gc.set_threshold(50_000, 20, 20)  # a compiler keeps nearly all that it makes
        for name, saturation in SKINS.items():
            Path(name).write_text(SKIN.format(saturation=saturation))
        Path("sweep.toml").write_text(STUDY)
        for command in COMMANDS[commands]:
            cli.main(command, standalone_mode=False)
        if commands == "skin":
            for name in SKINS:
                simulate_taxel(load_skin(name), 0)
        os.chdir("/")


def main() -> None:
    """Have all compiled side by side, and collect all tests meanwhile."""
    begun = [
        subprocess.Popen([sys.executable, __file__, commands]) for commands in COMMANDS
    ]
    collect = [sys.executable, "-m", "pytest", "--collect-only", "-qq"]
    # what cannot be collected is told by the tests' own run
    subprocess.run(collect, cwd=ROOT, check=False, stdout=subprocess.DEVNULL)
    sys.exit(any([one.wait() for one in begun]))


if __name__ == "__main__":
    compile_all(sys.argv[1]) if sys.argv[1:] else main()
