"""The guard process against owners that die, hang, or leave in peace."""

import os
import signal
import subprocess
import sys
import time

import pytest
from patient import patient

from drivers.coil import guard_process
from drivers.coil.guard import SILENCE, Guard, guard_settings
from drivers.coil.source import CoilSource
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.servers import PtyServer, TcpServer
from sim_backend.serial_line.wires import FarEnd
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.errors import InterlockError
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.instruments.guard_log import left_by_guard

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")

OWNER = """
import sys, time
import numpy as np
from drivers.coil import guard
from drivers.coil.source import CoilSource
from patient import patient
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.current_list import CurrentList
from tactile_lab.instruments.dialects import coil_dialect
guard.SILENCE = float(sys.argv[4])
clock = RealClock()
coil = CoilSource(patient(coil_dialect("kepco-bop")), sys.argv[1], CoilLimits(), clock)
coil.open()
coil.energise()
listed = sys.argv[3] == "list"
if listed:
    coil.load_list(CurrentList(np.array([0.3, 0.2] * 50 + [0.0]), np.full(101, 5.0)))
    coil.start_list()
print("live", flush=True)
end = clock.now() + float(sys.argv[2])
while clock.now() < end:
    if not listed:
        coil.set_current(0.3)
    coil.beat()
    clock.sleep_until(clock.now() + 0.02)
if sys.argv[3] == "die":
    import os
    os._exit(3)
print(coil.safe_off().verified, flush=True)
time.sleep(2 * guard.SILENCE)  # disarmed: silence is no danger
coil.close()
print("closed", flush=True)
"""

PATIENCE = 60.0
"""Longest wait for what a busy machine does late, s."""

LONG_SILENCE = 20.0
"""Silence that no starved owner reaches, for tests of something else, s."""


@pytest.fixture(params=["pty", "tcp"])
def served(request, resistor):
    row = coil_dialect("kepco-bop")
    clock = RealClock()
    source = SimCoilSource(resistor, row.id, clock)
    wire = row.serial.model_copy(update={"latency": 0.0})
    end = FarEnd(source, wire, clock, "coil")
    server = PtyServer(end) if request.param == "pty" else TcpServer(end)
    server.start()
    yield source, server
    server.close()


@pytest.fixture
def owner(served, tmp_path):
    started = []

    def start(seconds=PATIENCE, how="stay", silence=LONG_SILENCE):
        process = subprocess.Popen(
            [
                sys.executable,
                "-c",
                OWNER,
                served[1].url,
                str(seconds),
                how,
                str(silence),
            ],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ
            | {
                "XDG_STATE_HOME": str(tmp_path),
                "PYTHONPATH": os.pathsep.join(sys.path),
            },
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


def wait_until_off(source):
    until = time.monotonic() + PATIENCE
    while source.output_on and time.monotonic() < until:
        time.sleep(0.001)
    assert not source.output_on, "the output stayed on"


def log_of(folder, words=" after "):
    log = folder / "tactile-lab" / "guard.log"
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        if log.exists() and words in log.read_text():
            return log.read_text()
        time.sleep(0.01)
    raise AssertionError("the guard logged nothing of that")


def test_off_after_the_owner_is_killed(served, owner, tmp_path):
    source, _ = served
    process = owner()
    assert source.output_on
    process.kill()
    wait_until_off(source)
    assert source.setpoint == 0.0
    assert "the owner died" in log_of(tmp_path)
    log = tmp_path / "tactile-lab" / "guard.log"
    told = left_by_guard(process.pid, log)
    assert told.verified and "left the output verified off" in told.text
    assert left_by_guard(process.pid + 1, log) is None


def test_a_list_ends_with_its_owner(served, owner, tmp_path):
    """It would play for eight minutes more."""
    source, _ = served
    process = owner(how="list")
    assert source.list.playing
    process.kill()
    wait_until_off(source)
    assert not source.list.playing and source.setpoint == 0.0
    assert "output verified off" in log_of(tmp_path)


def test_a_list_ends_with_an_owner_that_hangs(served, owner, tmp_path):
    source, _ = served
    process = owner(how="list", silence=SILENCE)
    process.send_signal(signal.SIGSTOP)
    wait_until_off(source)
    assert not source.list.playing and source.setpoint == 0.0
    assert "silent" in log_of(tmp_path)


def test_off_though_a_person_took_the_source_to_its_front_panel(
    served, owner, tmp_path
):
    source, _ = served
    process = owner()
    source.local = True
    process.kill()
    wait_until_off(source)
    assert source.setpoint == 0.0
    assert "output verified off" in log_of(tmp_path)


def assert_switched_off(served, row, tmp_path):
    """Have a guard switch the served source off, which a row describes."""
    source, server = served
    log = tmp_path / "guard.log"
    told = guard_settings((server.url,), None, row, row.serial, log)
    ports = guard_process.prepared(told)
    off_at = guard_process.switch_off(told, ports, guard_process.GuardLog(str(log)))
    assert off_at == server.url, log.read_text()
    assert not source.output_on and source.setpoint == 0.0


def test_a_source_that_wants_a_rest_before_each_line_is_switched_off(
    served, tmp_path, monkeypatch
):
    """It heard the first line of four and no question, for a minute."""
    source, server = served
    monkeypatch.setattr(guard_process, "PATIENCE", 20.0)
    server.far_end.gap = 0.02
    row = patient(coil_dialect("kepco-bop"), timeout=0.3, min_gap=0.1)
    source.set_current(0.3)
    source.switch(True)
    assert_switched_off(served, row, tmp_path)


def test_a_source_that_answers_late_is_known_to_be_off(served, tmp_path, monkeypatch):
    """Its state was unknown after a minute: each try left before the answer came."""
    source, server = served
    monkeypatch.setattr(guard_process, "PATIENCE", 20.0)
    server.far_end.faults.add(SerialFault(kind="late", amount=0.4, times=None))
    row = patient(coil_dialect("kepco-bop"), timeout=0.1)
    source.set_current(0.3)
    source.switch(True)
    assert_switched_off(served, row, tmp_path)


STARVED = """
import os, threading, time
from drivers.coil import guard_process as guard
read, write = os.pipe()
os.dup2(read, 0)
owner = guard.OwnerPipe()
owner.armed, owner.last = True, time.monotonic() - 0.55
os.write(write, guard.BEAT)  # it came while this process did not run
threading.Timer(0.02, owner.listen).start()
threading.Timer(0.2, os.write, (write, guard.QUIT)).start()
print(guard.wait_for_danger(owner, 0.5), flush=True)
os._exit(0)
"""


def test_an_owner_whose_beats_wait_to_be_read_is_not_hung():
    """A guard that was itself starved kills no healthy run."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    asked = [sys.executable, "-c", STARVED]
    done = subprocess.run(asked, capture_output=True, text=True, env=environment)
    assert done.stdout == "None\n", done.stdout + done.stderr


def test_a_hung_owner_is_killed_first(served, owner, tmp_path):
    source, _ = served
    process = owner(silence=SILENCE)
    process.send_signal(signal.SIGSTOP)
    wait_until_off(source)
    assert process.wait(PATIENCE) == -signal.SIGKILL
    assert f"silent for {SILENCE:g} s; it was killed" in log_of(tmp_path)


def test_a_crash_without_cleanup(served, owner):
    source, _ = served
    process = owner(0.3, "die")
    assert process.wait(PATIENCE) == 3
    wait_until_off(source)


def test_a_peaceful_owner_is_left_alone(served, owner, tmp_path):
    source, _ = served
    process = owner(0.1, silence=2.0)
    assert process.stdout.read() == "True\nclosed\n"
    assert process.wait() == 0
    assert not source.output_on
    assert not (tmp_path / "tactile-lab" / "guard.log").exists()


def test_ctrl_c_at_the_terminal_does_not_reach_the_guard(served, owner):
    source, _ = served
    process = owner()
    group = os.getpgid(process.pid)
    children = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(process.pid)],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert len(children) == 1
    assert os.getpgid(int(children[0])) != group
    process.kill()
    wait_until_off(source)


@pytest.fixture
def guarded(served, tmp_path, monkeypatch):
    """A source guarded in this very process, its output on."""
    monkeypatch.setattr("drivers.coil.guard.SILENCE", LONG_SILENCE)
    monkeypatch.setattr("drivers.coil.wire.VERIFICATIONS", 1)
    _, server = served
    row = patient(coil_dialect("kepco-bop"), timeout=0.6)
    log = tmp_path / "tactile-lab" / "guard.log"
    guard = Guard(server.url, row, row.serial, log)
    coil = CoilSource(row, server.url, CoilLimits(), RealClock(), guard=guard)
    coil.open()
    coil.energise()
    yield coil, guard
    coil.close()


LETS_GO = """
import sys
from drivers.coil.guard_process import GuardLog
GuardLog(sys.argv[1]).leave_terminal("still not verified off")
sys.stdin.read()
"""


def test_a_guard_that_tries_on_lets_go_of_the_terminal(tmp_path):
    """`tactile-lab run | cat` waited a minute for it."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        [sys.executable, "-c", LETS_GO, str(tmp_path / "guard.log")],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    ) as process:
        assert "see " in process.stderr.read()  # to its end, while the process lives
        assert process.poll() is None
        process.stdin.close()


def test_a_dead_guard_stops_the_current(served, guarded):
    source, _ = served
    coil, guard = guarded
    os.kill(guard.pid, signal.SIGKILL)
    until = time.monotonic() + PATIENCE
    with pytest.raises(InterlockError, match="guard process is gone"):
        while time.monotonic() < until:
            coil.set_current(0.1)
            time.sleep(0.01)
    assert not source.output_on


def test_a_stopped_guard_stops_a_current_that_only_stands(served, guarded):
    source, _ = served
    coil, guard = guarded
    coil.set_current(0.01)
    os.kill(guard.pid, signal.SIGSTOP)
    until = time.monotonic() + PATIENCE
    with pytest.raises(InterlockError, match="was stopped by a signal"):
        while time.monotonic() < until:
            coil.read_current()
            time.sleep(0.01)
    assert not source.output_on
    os.kill(guard.pid, signal.SIGKILL)  # stopped, it would outlive the tests


def test_a_port_that_cannot_be_made_safe_is_handed_over(served, guarded, tmp_path):
    source, server = served
    coil, _ = guarded
    coil.set_current(0.01)
    server.far_end.faults.add(SerialFault(kind="deaf", times=None))
    assert not coil.safe_off().verified
    said = []
    coil._wire.link.spy = lambda *told: said.append(told)
    coil.close()
    assert said == []  # what was tried in vain is not tried again before it is handed
    log_of(tmp_path, "trying again")
    assert source.output_on
    server.far_end.faults.clear()
    wait_until_off(source)
    assert "could not verify" in log_of(tmp_path)
