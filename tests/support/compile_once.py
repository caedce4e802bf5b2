"""Have what is compiled on its first use compiled, once, before the tests begin.

    python tests/support/compile_once.py

Each worker of the tests would compile for itself what no other has kept yet, and each
would rewrite the assertions of every test. One core does this while another checks the
types.
"""

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
COMMANDS = (
    ("run", "demo", "--set", "protocol.hold=0.2 s"),
    ("simulate", "--set", "sensor.saturation=true"),
    ("skin", "plain.toml"),
    ("skin", "saturated.toml"),
    ("study", "sweep.toml"),
    ("validate", "stability", "--case", "R_k", "--cap", "0.01"),
)


def main() -> None:
    """Collect all tests; run one command after another in a folder then removed."""
    collect = [sys.executable, "-m", "pytest", "--collect-only", "-qq"]
    # what cannot be collected is told by the tests' own run
    subprocess.run(collect, cwd=ROOT, check=False, stdout=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        Path("plain.toml").write_text(SKIN.format(saturation=""))
        Path("saturated.toml").write_text(SKIN.format(saturation="saturation = true"))
        Path("sweep.toml").write_text(STUDY)
        for command in COMMANDS:
            cli.main(command, standalone_mode=False)
        simulate_taxel(load_skin("plain.toml"), 0)
        os.chdir("/")


if __name__ == "__main__":
    main()
