"""The hardware checklists themselves run, on served instruments in real time."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

from sim_backend.coil.source import SimCoilSource
from sim_backend.serve import ServedBench

ROOT = Path(__file__).parents[2]

TOLD = {
    "coil_source": ("FACT answer after 99 A: -222", "2 skipped"),  # need a person
    "teslameter": ("FACT their standard deviation, T",),
    "thermometer": ("FACT their standard deviation, K", "30 ms between messages"),
    "voltage_source": ("FACT left: V_GS at",),
}
"""What is read in the answer of each."""


def begun(which: str, port: str, state: Path) -> subprocess.Popen[str]:
    """The checklist of one instrument, in a process of its own."""
    return subprocess.Popen(
        [
            *(sys.executable, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider"),
            f"tests/hardware/test_{which}.py",
        ],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ
        | {
            "TACTILE_LAB_HARDWARE": {"coil_source": "coil"}.get(which, which),
            "TACTILE_LAB_PORT": port,
            "XDG_STATE_HOME": str(state),
        },
    )


def _strict(bench: ServedBench) -> None:
    """Have the Kepco in local whenever nobody has asked for remote control."""
    source = bench._servers["coil"].far_end.instrument
    assert isinstance(source, SimCoilSource)
    act, source.local = source.line, True

    def line(text: bytes) -> bytes | None:
        answer = act(text)
        source.local = source.local or b"SYST:REM 0" in text
        return answer

    source.line = line  # type: ignore[method-assign]


def test_the_checklists_pass_on_served_instruments(tmp_path: Path) -> None:
    """All at once: they wait for their instruments, not for each other."""
    bench = ServedBench(
        coil="pty", teslameter="tcp:0", voltage_source="pty", thermometer="pty"
    )
    _strict(bench)
    bench.start()
    ports = bench.addresses | {"coil_source": bench.addresses["coil"]}
    running = {}
    with ExitStack() as ending:
        ending.callback(bench.close)
        for which in TOLD:
            process = ending.enter_context(begun(which, ports[which], tmp_path))
            ending.callback(process.kill)
            running[which] = process
        for which, process in running.items():
            said, _ = process.communicate()
            assert process.returncode == 0, said
            for words in TOLD[which]:
                assert words in said
