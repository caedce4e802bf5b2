"""`tactile-lab run` with coil source and source meter on pseudo-terminals, killed."""

import json
import os
import signal
import subprocess
import sys
import time
from importlib import resources

import pytest
from benches import SERVED

from sim_backend.serve import ServedBench

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")

SCENE = """
[protocol]
name = "pulses"
levels = ["80 mN"]
[record]
signals = ["force"]
[sensor]
V_GS = "1.405 V"
sourced = ["V_GS"]
"""
SOURCE = """
[coil.limits]
recovery = "0.1 s"
[voltage_source.V_GS]
dialect = "{dialect}"
port = "{port}"
[voltage_source.V_GS.limits]
highest = "2 V"
slew = "20 V/s"
"""
PATIENCE = 60.0
"""Longest wait for what a busy machine does late, s."""


@pytest.fixture
def bench(tmp_path):
    served = ServedBench(coil="pty", voltage_source="pty", log=tmp_path / "log.jsonl")
    served.start()
    text = SERVED.format(port=served.addresses["coil"])
    port = served.addresses["voltage_source"]
    text += SOURCE.format(dialect="patient-source.toml", port=port)
    (tmp_path / "bench.toml").write_text(text)
    (tmp_path / "scene.toml").write_text(SCENE)
    rows = resources.files("tactile_lab.instruments").joinpath("rows")
    for folder, row, name in (
        ("coil", "kepco-bop", "patient"),
        ("voltage_source", "keithley-2400-voltage", "patient-source"),
    ):
        said = rows.joinpath(folder, f"{row}.toml").read_text()
        patient = said.replace("[serial]", '[serial]\ntimeout = "800 ms"')
        (tmp_path / f"{name}.toml").write_text(patient.replace(f'"{row}"', f'"{name}"'))
    yield served
    served.close()


def begin(folder):
    return subprocess.Popen(
        [
            *(sys.executable, "-m", "tactile_lab", "run", "scene.toml"),
            *("--bench", "bench.toml", "--no-report", "--json"),
        ],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"XDG_STATE_HOME": str(folder)},
    )


def changes(folder):
    text = (folder / "log.jsonl").read_text()
    whole = text[: text.rfind("\n") + 1]
    return [json.loads(line) for line in whole.splitlines()]


def wait_until(there, what):
    until = time.monotonic() + PATIENCE
    while not there():
        assert time.monotonic() < until, what
        time.sleep(0.02)


def coil_is_off(folder):
    outputs = [d["value"] for d in changes(folder) if d["what"] == "output"]
    return bool(outputs) and outputs[-1] == 0


def test_a_killed_run_leaves_V_GS_where_it_was_and_the_next_takes_it_over(
    bench, tmp_path
):
    """The guard switches the coil off; the gate keeps its operating point."""
    run = begin(tmp_path)
    wait_until(
        lambda: any(d["what"] == "set" and d["value"] > 0.2 for d in changes(tmp_path)),
        "no current ever flowed",
    )
    assert bench.gate.volts["V_GS"] == pytest.approx(1.405)
    run.send_signal(signal.SIGKILL)
    run.communicate()
    wait_until(lambda: coil_is_off(tmp_path), "the guard did not switch the coil off")
    assert bench.gate.volts["V_GS"] == pytest.approx(1.405)
    seen = []
    gate = bench.gate.set_voltage
    bench.gate.set_voltage = lambda *given: (seen.append(given[2]), gate(*given))
    again = begin(tmp_path)
    said, wrong = again.communicate(timeout=PATIENCE)
    assert again.returncode == 0, wrong
    before_rest = seen[: next(i for i, v in enumerate(seen) if v < 1.4)]
    assert before_rest and min(before_rest) == pytest.approx(1.405), "no jump"
    assert bench.gate.volts["V_GS"] == 0.0, "and then it goes to rest"
    assert coil_is_off(tmp_path)
    told = json.loads((tmp_path / json.loads(said)["run"] / "run.json").read_text())
    assert "output off" in told["voltages_left"]["V_GS"]
