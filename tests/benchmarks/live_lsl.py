"""From a spike to who hears of it by LSL, and what a killed subscriber misses.

    python tests/benchmarks/live_lsl.py [--window] [--seconds 600] [--out FILE]

The whole program in real time on the built-in bench, four channels at 1 MS/s stored:
`tactile-lab run`, or with --window a run of the window (`live_window.py`). Of two
subscribers in processes of their own one stays, the other is killed with SIGKILL every
30 s and started again. A delay is LSL's clock when a sample was heard,
less the sample's time stamp: it holds the scope's polls, detection, LSL and the way to
the other process. Takes --seconds and about a minute; the exit code is 1 where the
run lost a sample or a spike, or a subscriber missed one while it was connected.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from provenance import provenance, tell

HOLD, REST = 1.0, 2.0
KILL_EVERY = 30.0
HERE = Path(__file__).parent
SCENE = """
[protocol]
name = "pulses"
levels = {levels}
hold = "{hold} s"
rest = "{rest} s"

[record]
sample_rate = "1 MS/s"
signals = ["coil_current", "V_C1", "V_C2", "V_K", "spikes"]
"""
SUBSCRIBER = """
import sys
import pylsl
from pylsl.util import LostError
(found,) = pylsl.resolve_byprop("source_id", sys.argv[1], timeout=60)
inlet = pylsl.StreamInlet(found, recover=False)
inlet.open_stream()
print("open", pylsl.local_clock(), 0, flush=True)
try:
    while True:
        sample, stamp = inlet.pull_sample()
        print(int(sample[0]), stamp, pylsl.local_clock(), flush=True)
except LostError:
    pass
"""


class Subscriber:
    """Writes what it hears into a file of its own, in a process of its own."""

    def __init__(self, folder: Path, name: str, source: str) -> None:
        self.path = folder / name
        with self.path.open("w") as told:
            self.process = subprocess.Popen(
                [sys.executable, "-c", SUBSCRIBER, f"{source}-spikes"],
                stdout=told,
                stderr=subprocess.DEVNULL,
            )

    def heard(self) -> NDArray[np.float64]:
        """Number, time stamp (s) and LSL's time when heard (s); shape (n, 3)."""
        lines = self.path.read_text().splitlines()[1:]
        whole = [line.split() for line in lines if len(line.split()) == 3]
        return np.array(whole, np.float64).reshape(-1, 3)


def main() -> int:
    """Measure, print, and write the table; 1 where something was lost."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=float, default=600.0)
    options.add_argument("--out", type=Path)
    options.add_argument("--window", action="store_true")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        table, sound = measured(chosen.seconds, chosen.window, Path(folder))
    tell(table, chosen.out)
    return 0 if sound else 1


def measured(seconds: float, window: bool, folder: Path) -> tuple[str, bool]:
    """The page, and whether nothing was lost; `folder` takes the run."""
    presses = round(seconds / (HOLD + REST + 0.5))
    scene = folder / "live.toml"
    levels = json.dumps(["160 mN"] * presses)
    scene.write_text(SCENE.format(levels=levels, hold=HOLD, rest=REST))
    runs = str(folder / "runs")
    verb = [sys.executable, "-m", "tactile_lab", "run", str(scene), "--realtime"]
    verb += ["--json", "--live", "lsl", "--no-report", "--out", runs]
    if window:
        verb = [sys.executable, str(HERE / "live_window.py"), str(scene), runs]
    load = os.getloadavg()[0]
    with (folder / "said").open("w+") as said:
        run = subprocess.Popen(verb, stdout=subprocess.PIPE, stderr=said, text=True)
        source = ""
        while not source:
            time.sleep(0.05)
            words = (folder / "said").read_text().split()
            if "lsl" in words[:-1]:
                source = words[words.index("lsl") + 1]
            if run.poll() is not None:
                raise SystemExit((folder / "said").read_text())
        stays = Subscriber(folder, "stays", source)
        killed: list[Subscriber] = []
        while run.poll() is None:
            killed.append(Subscriber(folder, f"killed{len(killed)}", source))
            end = time.monotonic() + KILL_EVERY
            while run.poll() is None and time.monotonic() < end:
                time.sleep(0.1)
            if run.poll() is None:
                killed[-1].process.send_signal(signal.SIGKILL)
            killed[-1].process.wait()
        stays.process.wait()
        assert run.stdout is not None
        told = run.stdout.read()
        if run.returncode:
            raise SystemExit((folder / "said").read_text())
        first, *more = told.splitlines()
        if more:  # what a library said on its way out
            print(*more, sep="\n", file=sys.stderr)
        result = json.loads(first)
    heard = stays.heard()
    number, delay = heard[:, 0], heard[:, 2] - heard[:, 1]
    spikes = int(result["spikes"])
    missed = spikes - len(set(number.tolist()))
    gaps = sum(int(np.sum(np.diff(one.heard()[:, 0]) != 1)) for one in killed)
    again = np.concatenate([one.heard() for one in killed])
    away = spikes - len(set(again[:, 0].tolist()))
    late = again[:, 2] - again[:, 1]
    lost = result["loss"]
    rows = [
        ("run", f"{result['duration_s']:.0f} s, {result['status']}, {spikes} spikes"),
        (
            "samples and spikes lost of the record",
            f"{lost['samples']}, {lost['spikes']}",
        ),
        ("missed by the subscriber that stays", str(missed)),
        ("kills of the other", str(len(killed) - 1)),
        ("gaps in what it heard while connected", str(gaps)),
        ("spikes while it was dead, by their numbers", str(away)),
        ("delay of the one that stays, ms", quantiles(delay)),
        ("delay of the other, ms", quantiles(late)),
    ]
    sound = not (lost["samples"] or lost["spikes"] or missed or gaps)
    ran = "a run of the window, painted offscreen," if window else "the whole program"
    option, opened = (" --window", ", the window open") if window else ("", "")
    lines = [
        f"# Spikes told live{opened}, in figures",
        "",
        f"{provenance()}, load {load:.1f} as it began. Made by "
        f"`tests/benchmarks/live_lsl.py{option} --seconds {seconds:g}`: {ran} in real "
        "time on the built-in bench, four channels at 1 MS/s, simulated far ends in "
        "the same process as the drivers. A delay is from the sample of the spike, by "
        "the run's first sample and the scope's clock, to the subscriber.",
        "",
        "| | |",
        "|---|---|",
        *(f"| {what} | {is_} |" for what, is_ in rows),
    ]
    return "\n".join(lines) + "\n", sound


def quantiles(delay: NDArray[np.float64]) -> str:
    """Median, 99th percentile and largest of delays in s, as ms."""
    median, p99 = np.percentile(1e3 * delay, [50, 99])
    return f"median {median:.1f}, p99 {p99:.1f}, largest {1e3 * delay.max():.1f}"


if __name__ == "__main__":
    sys.exit(main())
