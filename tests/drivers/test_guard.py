"""The guard process against owners that die, hang, or leave in peace."""

import os
import signal
import subprocess
import sys
import time

import pytest

from drivers.dialect import coil_dialect
from sim_backend.coil_source import SimCoilSource
from sim_backend.serial_servers import PtyServer, TcpServer
from sim_backend.serial_wires import FarEnd
from tactile_lab.clock import RealClock

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")

OWNER = """
import sys, time
from drivers.coil_source import CoilSource
from drivers.dialect import coil_dialect
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
clock = RealClock()
coil = CoilSource(coil_dialect("kepco-bop"), sys.argv[1], CoilLimits(), clock)
coil.open()
coil.energise()
print("live", flush=True)
end = clock.now() + float(sys.argv[2])
while clock.now() < end:
    coil.set_current(0.3)
    coil.beat()
    clock.sleep_until(clock.now() + 0.02)
if sys.argv[3] == "die":
    import os
    os._exit(3)
print(coil.safe_off().verified, flush=True)
time.sleep(1.0)  # disarmed: silence is no danger
coil.close()
print("closed", flush=True)
"""


@pytest.fixture(params=["pty", "tcp"])
def served(request, resistor):
    row = coil_dialect("kepco-bop")
    clock = RealClock()
    source = SimCoilSource(resistor, row.id, clock)
    wire = row.serial.model_copy(update={"latency": 0.0})
    end = FarEnd(source, wire, clock, "coil")
    server = PtyServer(end) if request.param == "pty" else TcpServer(end)
    server.start()
    yield clock, source, server
    server.close()


@pytest.fixture
def owner(served, tmp_path):
    started = []

    def start(seconds=30.0, how="stay"):
        process = subprocess.Popen(
            [sys.executable, "-c", OWNER, served[2].url, str(seconds), how],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"XDG_STATE_HOME": str(tmp_path)},
        )
        started.append(process)
        assert process.stdout.readline() == "live\n"
        return process

    yield start
    for process in started:
        process.kill()
        if process.wait() != 0:
            log_of(tmp_path)  # else its guard would open the next test's terminal
        process.stdout.close()


def time_to_off(clock, source, since, patience=3.0):
    while source.output_on and clock.now() < since + patience:
        time.sleep(0.001)
    assert not source.output_on, "the output stayed on"
    last = [deed for deed in source.deeds if deed.what == "output"][-1]
    return last.time - since


def log_of(tmp_path, patience=2.0):
    log = tmp_path / "tactile-lab" / "guard.log"
    until = time.monotonic() + patience
    while time.monotonic() < until:
        if log.exists() and " after " in log.read_text():
            return log.read_text()
        time.sleep(0.01)
    raise AssertionError("the guard logged nothing")


def test_off_after_the_owner_is_killed(served, owner, tmp_path):
    clock, source, _ = served
    process = owner()
    time.sleep(0.2)
    assert source.output_on
    since = clock.now()
    process.kill()
    assert time_to_off(clock, source, since) < 0.3
    assert source.setpoint == 0.0
    assert "the owner died" in log_of(tmp_path)


def test_a_hung_owner_is_killed_first(served, owner, tmp_path):
    clock, source, _ = served
    process = owner()
    time.sleep(0.2)
    since = clock.now()
    process.send_signal(signal.SIGSTOP)
    assert 0.4 < time_to_off(clock, source, since) < 1.2
    assert process.wait(2.0) == -signal.SIGKILL
    assert "silent for 0.5 s; it was killed" in log_of(tmp_path)


def test_a_crash_without_cleanup(served, owner):
    clock, source, _ = served
    process = owner(0.3, "die")
    assert process.wait(3.0) == 3
    time_to_off(clock, source, clock.now())


def test_a_peaceful_owner_is_left_alone(served, owner, tmp_path):
    _, source, _ = served
    process = owner(0.3)
    assert process.stdout.read() == "True\nclosed\n"
    assert process.wait() == 0
    assert not source.output_on
    assert not (tmp_path / "tactile-lab" / "guard.log").exists()


def test_ctrl_c_at_the_terminal_does_not_reach_the_guard(served, owner):
    clock, source, _ = served
    process = owner()
    group = os.getpgid(process.pid)
    children = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(process.pid)],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert len(children) == 1
    assert os.getpgid(int(children[0])) != group
    since = clock.now()
    process.kill()
    time_to_off(clock, source, since)


def test_a_dead_guard_stops_the_current(served, tmp_path):
    from drivers.coil_source import CoilSource
    from drivers.guard import Guard
    from tactile_lab.bench import CoilLimits
    from tactile_lab.errors import InterlockError

    clock, source, server = served
    row = coil_dialect("kepco-bop")
    guard = Guard(server.url, row, row.serial, tmp_path / "guard.log")
    coil = CoilSource(row, server.url, CoilLimits(), clock, guard=guard)
    coil.open()
    coil.energise()
    os.kill(guard.pid, signal.SIGKILL)
    until = time.monotonic() + 2.0
    with pytest.raises(InterlockError, match="guard process is gone"):
        while time.monotonic() < until:
            coil.set_current(0.1)
            time.sleep(0.01)
    assert not source.output_on
    coil.close()


def test_a_port_that_cannot_be_made_safe_is_handed_over(served, tmp_path):
    from drivers.coil_source import CoilSource
    from drivers.guard import Guard
    from sim_backend.faults import SerialFault
    from tactile_lab.bench import CoilLimits

    clock, source, server = served
    row = coil_dialect("kepco-bop")
    log = tmp_path / "tactile-lab" / "guard.log"
    guard = Guard(server.url, row, row.serial, log)
    coil = CoilSource(row, server.url, CoilLimits(), clock, guard=guard)
    coil.open()
    coil.energise()
    coil.set_current(0.01)
    server.far_end.faults.add(SerialFault(kind="deaf", times=None))
    assert not coil.safe_off().verified
    coil.close()
    time.sleep(0.8)  # longer than the guard's patience with a silent owner: we live
    assert source.output_on
    server.far_end.faults.clear()
    time_to_off(clock, source, clock.now())
    assert "could not verify" in log_of(tmp_path)
