"""Figures of the serial instruments: time to output-off, set-points a second.

    python tests/benchmarks/serial_bench.py [--kills N] [--out docs/serial-figures.md]

The source is served from this process; each owner is a process of its own, killed at a
seeded random instant of a waveform.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from shutil import which

from provenance import provenance, tell

from drivers.coil.source import CoilSource
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.servers import PtyServer, SerialServer, TcpServer
from sim_backend.serial_line.wires import FarEnd
from sim_backend.serve import CoilOnly
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.magnetics import Magnet

OWNER = """
import os
import sys
import numpy as np
from drivers.coil.source import CoilSource
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.current_list import CurrentList

def own(url, playing):
    clock = RealClock()
    row, analogue = coil_dialect("kepco-bop"), playing == "generator"
    coil = CoilSource(row, url, CoilLimits(list_slew=100.0), clock, analogue=analogue)
    coil.open()
    coil.energise()
    if playing == "list":  # 20 Hz, 8 s long
        wave = 0.1 * np.sin(2 * np.pi * np.arange(800) / 5)
        coil.load_list(CurrentList(np.append(wave, 0.0), np.full(801, 0.01)))
        coil.start_list()
    elif playing == "generator":  # 0.3 A for 20 s; who serves the source plays it
        points = np.array([0.0, 0.3, 0.0]), np.array([0.1, 20.0, 0.1])
        coil.follow(CurrentList(*points), 0.0)
    print("live", os.getpid(), flush=True)
    k = 0
    while True:
        if playing == "set-points":
            coil.set_current(0.3 if k // 25 % 2 else -0.3)
        elif playing == "list":
            coil.read_current()
        coil.beat()
        clock.sleep_until(clock.now() + max(0.01, coil.update_interval))
        k += 1

for line in sys.stdin:
    child = os.fork()  # what it imported is there already
    if child == 0:
        own(*line.split())
    os.waitpid(child, 0)
"""


def served(
    kind: str, baud: int | None
) -> tuple[SimCoilSource, CoilOnly, SerialServer, RealClock]:
    """A Kepco at the far end of a `pty` or `tcp` wire, paced if `baud` is given."""
    clock = RealClock()
    plant = CoilOnly(Magnet(r=6e-3))
    source = SimCoilSource(plant, "kepco-bop", clock)
    source.wire_analogue_input()
    wire = coil_dialect("kepco-bop").serial
    change = {"baud": baud} if baud else {"latency": 0.0}
    end = FarEnd(source, wire.model_copy(update=change), clock, "coil")
    paced = baud is not None
    server = (
        PtyServer(end, paced=paced) if kind == "pty" else TcpServer(end, paced=paced)
    )
    server.start()
    return source, plant, server, clock


def times_to_off(
    kind: str, baud: int | None, how: int, times: int, playing: str
) -> list[float]:
    """Seconds from signal `how` to output off, for each of `times` owners.

    They are `playing` "set-points", a "list", or follow a "generator" that plays on.
    """
    chance, found = random.Random(1), []
    with tempfile.TemporaryDirectory() as state:
        owners = subprocess.Popen(
            [*unprivileged(), sys.executable, "-c", OWNER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"XDG_STATE_HOME": state},
            text=True,
        )
        assert owners.stdin is not None and owners.stdout is not None
        for _ in range(times):
            source, plant, server, clock = served(kind, baud)
            print(server.url, playing, file=owners.stdin, flush=True)
            live, pid = owners.stdout.readline().split()
            assert live == "live"
            if playing == "generator":
                plant.analogue_input([(clock.now(), 0.6)])
            time.sleep(chance.uniform(0.05, 0.6))
            assert playing != "generator" or source.measured_current() > 0.2
            since = clock.now()
            os.kill(int(pid), how)
            while source.output_on and clock.now() < since + 10:
                time.sleep(0.0005)
            assert not source.output_on, "the output stayed on"
            off = [d for d in source.changes if d.what == "output"][-1]
            found.append(off.time - since)
            assert not source.list.playing, "the list plays on"
            clock.sleep_until(off.time + 0.05)  # the coil's lag
            assert abs(source.measured_current()) < 1e-3, "a current flows on"
            logged(Path(state), len(found))
            with suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)
            server.close()
        owners.stdin.close()
        owners.wait()
        owners.stdout.close()
    return found


def unprivileged() -> tuple[str, ...]:
    """What starts a program as a lab's user does: it may not raise its priority."""
    if os.geteuid() != 0 or which("setpriv") is None:
        return ()
    return "setpriv", "--bounding-set=-sys_nice", "nice", "-n", "20"


def logged(state: Path, times: int) -> None:
    """Wait until so many guards are done; one at work would open the next terminal."""
    log = state / "tactile-lab" / "guard.log"
    while not log.exists() or log.read_text().count(" after ") < times:
        time.sleep(0.002)


def rates(kind: str, baud: int | None, seconds: float) -> tuple[float, float, float]:
    """(verified set-points a second, p50 s, p99 s) of one round trip."""
    _, _, server, clock = served(kind, baud)
    coil = CoilSource(
        coil_dialect("kepco-bop"),
        server.url,
        CoilLimits(),
        clock,
        baud=baud,
        guarded=False,
    )
    coil.open()
    coil.energise()
    trips = []
    end = clock.now() + seconds
    while (begun := clock.now()) < end:
        coil.set_current(0.1)
        trips.append(clock.now() - begun)
    coil.close()
    server.close()
    cuts = statistics.quantiles(trips, n=100)
    return len(trips) / seconds, cuts[49], cuts[98]


def main() -> None:
    """Measure, print, and write the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kills", type=int, default=50)
    options.add_argument("--seconds", type=float, default=2.0)
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    with suppress(OSError):
        os.nice(-20)  # the source is an instrument: no computer's load slows it
    lines = [
        "# Serial instruments in figures",
        "",
        f"{provenance()}. Made by "
        f"`tests/benchmarks/serial_bench.py --kills {chosen.kills}`. `load`: of the "
        "computer meanwhile, by others. Times are from the signal to the "
        "output off. A generator plays on after its owner is gone.",
        "",
        "| owner's end | playing | wire | kills | median, ms | worst, ms | load |",
        "|---|---|---|---|---|---|---|",
    ]
    few = max(3, chosen.kills // 10)
    kill, hang = ("SIGKILL", signal.SIGKILL), ("SIGSTOP (hangs)", signal.SIGSTOP)
    for (name, how), playing, kind, baud, times in (
        (kill, "set-points", "pty", None, chosen.kills),
        (kill, "list", "pty", None, chosen.kills),
        (kill, "generator", "pty", None, chosen.kills),
        (kill, "set-points", "tcp", None, few),
        (kill, "list", "tcp", None, few),
        (kill, "set-points", "pty", 9600, few),
        (kill, "list", "pty", 9600, few),
        (hang, "set-points", "pty", None, few),
        (hang, "list", "pty", None, few),
        (hang, "generator", "pty", None, few),
    ):
        found = times_to_off(kind, baud, how, times, playing)
        wire = f"{kind}, {baud} baud" if baud else f"{kind}, unpaced"
        lines.append(
            f"| {name} | {playing} | {wire} | {times} | "
            f"{1e3 * statistics.median(found):.0f} | {1e3 * max(found):.0f} | "
            f"{os.getloadavg()[0]:.0f} |"
        )
        print(lines[-1], flush=True)
    lines += [
        "",
        "| wire | verified set-points a second | p50, ms | p99, ms |",
        "|---|---|---|---|",
    ]
    for kind, baud in (
        ("pty", None), ("tcp", None), ("pty", 9600), ("pty", 19200), ("pty", 115200),
    ):  # fmt: skip
        rate, p50, p99 = rates(kind, baud, chosen.seconds)
        wire = f"{kind}, {baud} baud, 10 ms to act" if baud else f"{kind}, unpaced"
        lines.append(f"| {wire} | {rate:.0f} | {1e3 * p50:.2f} | {1e3 * p99:.2f} |")
    text = "\n".join(lines) + "\n"
    tell(text, chosen.out)


if __name__ == "__main__":
    main()
