"""The window over a simulated hour, and beside instruments that misbehave.

    python tests/benchmarks/window_endurance.py [HOUR_SECONDS]

First a run of one hour (or so many seconds) on the simulated clock, some ten times
faster than life, engine in its own process: the memory of window and engine on the way.
Then runs in real time, engine in a thread so that their far ends can be reached, with a
coil source that answers late and one whose plug is pulled: the longest gap of a 10 ms
heartbeat in the window's thread, and what the window says in the end.
"""

import sys
import tempfile
import time
from pathlib import Path

from window_frames import Bench, memory

from gui.app import begin
from gui.state import WindowState
from sim_backend.serial_line import wires as serial_wires
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.engine.request import Request

HOUR = """
[protocol]
name = "pulses"
levels = ["120 mN"]
hold = "{seconds} s"

[record]
sample_rate = "20 kS/s"
"""

SLOW = {
    "coil answers 0.2 s late": SerialFault(kind="late", times=None, amount=0.2),
    "coil answers 1 s late, once": SerialFault(kind="late", amount=1.0),
    "coil does not answer": SerialFault(kind="missing", times=None),
    "coil unplugged": SerialFault(kind="unplug", times=None),
}


def endurance(seconds: float, folder: Path) -> None:
    """Print both memories at parts of one long run."""
    bench = Bench(folder, realtime=False)
    session = bench.session
    begin(bench.window, None, "sim")
    bench.until(
        lambda: session.state is WindowState.READY and session.plan.expectation, 120
    )
    (folder / "hour.toml").write_text(HOUR.format(seconds=seconds))
    request = Request(str(folder / "hour.toml"), (), "sim")
    session.start(request, "hour")
    begun = time.monotonic()
    first: tuple[float, float] | None = None
    print("| run, s | wall, s | window, MB | engine, MB |\n|---|---|---|---|")
    for part in (0.05, 0.25, 0.5, 0.75, 1.0):
        bench.until(
            lambda: (
                session.state is not WindowState.RUNNING
                or (session.source and session.source.reach >= part * seconds)  # noqa: B023  waited for
            ),
            3600,
        )
        now = memory(), memory(session.link.pid or "self")
        first = first or now
        print(
            f"| {part * seconds:.0f} | {time.monotonic() - begun:.0f} | "
            f"{now[0]:.0f} ({now[0] - first[0]:+.0f}) | "
            f"{now[1]:.0f} ({now[1] - first[1]:+.0f}) |"
        )
    bench.until(lambda: session.state in (WindowState.READY, WindowState.FAULT), 60)
    fault = "" if session.status.fault is None else f": {session.status.fault.title}"
    assert session.source is not None
    bench.say(
        f"Then {session.state.value}{fault}, {session.source.spikes.size} spikes."
    )
    bench.window.close()
    session.close()


def faults(folder: Path) -> None:
    """Print the longest gap of a run with each fault."""
    bench = Bench(folder, separate=False)
    session, window = bench.session, bench.window
    begin(window, None, "sim")
    bench.until(
        lambda: session.state is WindowState.READY and session.plan.expectation, 120
    )
    endings = []
    for name, fault in SLOW.items():
        window.setup.start()
        bench.until(lambda: (c := session.coil_view()) and c.output, 60)
        wires = serial_wires.__dict__["_far_ends"]
        coil = [far for wire, far in wires.items() if "coil" in wire][-1]
        bench.clear()
        coil.faults.add(fault)
        bench.until(lambda: session.state is not WindowState.RUNNING, 4)
        session.stop("enough")
        bench.until(lambda: session.state in (WindowState.READY, WindowState.FAULT), 60)
        bench.until(lambda: not session.busy, 60)
        said = (
            "" if session.status.fault is None else f" · {session.status.fault.title}"
        )
        bench.report(name)
        words = f"{session.state.value}{said} · {window.header.stop.words.spoken}"
        endings.append(f"{name}: {words}")
        session.acknowledge()
        session.connect_bench("sim")
        bench.until(lambda: session.state in (WindowState.READY, WindowState.FAULT), 60)
    bench.say(f"In the end: {'; '.join(endings)}.")
    window.close()
    session.close()


if __name__ == "__main__":
    length = float(sys.argv[1]) if len(sys.argv) > 1 else 3600.0
    with tempfile.TemporaryDirectory() as made:
        endurance(length, Path(made))
    with tempfile.TemporaryDirectory() as made:
        faults(Path(made))
