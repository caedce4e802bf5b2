"""The hardware checklist itself runs, on served instruments in real time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from sim_backend.serve import ServedBench

ROOT = Path(__file__).parents[2]


def rehearse(which: str, port: str, state: Path) -> str:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider"),
            f"tests/hardware/test_{which}.py",
        ],
        cwd=ROOT,
        check=False,
        capture_output=True,
        text=True,
        env=os.environ
        | {
            "TACTILE_LAB_HARDWARE": {"coil_source": "coil"}.get(which, which),
            "TACTILE_LAB_PORT": port,
            "XDG_STATE_HOME": str(state),
        },
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_checklists_pass_on_served_instruments(tmp_path: Path) -> None:
    bench = ServedBench(coil="pty", teslameter="tcp:0", voltage_source="pty")
    bench.start()
    try:
        told = rehearse("coil_source", bench.addresses["coil"], tmp_path)
        assert "FACT answer after 99 A: -222" in told
        assert "2 skipped" in told  # those that need a person
        told = rehearse("teslameter", bench.addresses["teslameter"], tmp_path)
        assert "FACT their standard deviation, T" in told
        told = rehearse("voltage_source", bench.addresses["voltage_source"], tmp_path)
        assert "FACT left: V_GS at" in told
    finally:
        bench.close()
