import json
import signal
import subprocess
import sys
import time

import pytest
from patient import patient

from drivers.coil.source import CoilSource
from drivers.teslameter import Teslameter
from sim_backend.serve import ServedBench
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.errors import InstrumentError, SceneError
from tactile_lab.instruments.dialects import coil_dialect, teslameter_dialect

KEPCO = patient(coil_dialect("kepco-bop"))
LAKESHORE = patient(teslameter_dialect("lakeshore-425"))


@pytest.mark.parametrize("where", ["pty", "tcp:0"])
def test_both_instruments_look_at_one_coil(where, tmp_path):
    log = tmp_path / "changes.jsonl"
    bench = ServedBench(coil=where, teslameter=where, log=log)
    bench.start()
    clock = RealClock()
    coil = CoilSource(
        KEPCO,
        bench.addresses["coil"],
        CoilLimits(),
        clock,
        guarded=False,
    )
    meter = Teslameter(LAKESHORE, bench.addresses["teslameter"], clock)
    coil.open()
    meter.open()
    coil.energise()
    while coil.setpoint < 0.2:
        clock.sleep_until(clock.now() + coil.update_interval)
        coil.set_current(0.2)
    time.sleep(0.1)
    assert coil.read_current().value == pytest.approx(0.2, rel=1e-3)
    assert meter.read().value == pytest.approx(2.2e-3, rel=0.01)
    coil.close()
    meter.close()
    bench.close()
    told = [json.loads(line) for line in log.read_text().splitlines()]
    assert [d["value"] for d in told if d["what"] == "output"] == [0.0, 1.0, 0.0]


@pytest.mark.parametrize("where", ["tcp:99999", "tcp:x", "com3", "tcp"])
def test_an_address_that_is_none(where):
    with pytest.raises(SceneError, match="pty, or tcp:PORT"):
        ServedBench(coil=where)


def test_a_row_nobody_knows():
    with pytest.raises(SceneError, match="no dialect"):
        ServedBench(coil="pty", coil_row="mine")


def test_a_taken_port():
    first = ServedBench(coil="tcp:0")
    port = first.addresses["coil"].rsplit(":", 1)[1]
    with pytest.raises(InstrumentError, match="choose another"):
        ServedBench(coil=f"tcp:{port}")
    first.close()


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_the_command_serves_until_told_to_end(ending):
    served = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "tactile_lab",
            "serve-bench",
            "--coil",
            "tcp:0",
            "--json",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    address = json.loads(served.stdout.readline())["coil"]
    coil = CoilSource(KEPCO, address, CoilLimits(), RealClock(), guarded=False)
    coil.open()
    assert coil.identity.startswith("KEPCO")
    coil.close()
    served.send_signal(ending)
    assert served.wait(60) == 0
    served.stdout.close()


def test_the_command_refuses_nonsense():
    done = subprocess.run(
        [sys.executable, "-m", "tactile_lab", "serve-bench", "--coil", "lpt1"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "pty, or tcp:PORT" in done.stderr and "Traceback" not in done.stderr
