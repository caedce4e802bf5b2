"""How near the force comes to the one asked for, by set-points, lists and generator.

    python tests/benchmarks/force_following.py [--out docs/force-figures.md]

Each row is a run of the whole program on the built-in bench: driver, wire, the source's
own list or the scope's generator, coil and core. The true force is that of the
simulated magnet under what the source really played, put where it lies best.
"""

from __future__ import annotations

import argparse
import tempfile
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from provenance import provenance, tell

from protocols.touch import Touch
from protocols.vibration import Vibration
from sim_backend.plant.electromagnet import Electromagnet
from tactile_lab.engine.execution import Execution
from tactile_lab.planning.ways import ways_used
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.store.run import Run
from tactile_lab.waveform import Waveform

STEP = 1e-4
"""Time between two looks at the force, s."""


def main() -> None:
    """Measure, print, and write the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    lines = [
        "# A force without stairs, in figures",
        "",
        f"{provenance()}. Made by `tests/benchmarks/force_following.py`: runs of the "
        "whole program on the built-in bench (Kepco at 19200 baud, coil 1.1 ms, core "
        "3 ms, known to ±1 ms; the scope's generator at 0.5 A/V). `plan`: what the "
        "plan says. `true`: largest difference of the simulated magnet's force from "
        "the one asked for, as a part of its range of 0 to 120 mN, where it lies best "
        "within 60 ms (samples and applied "
        "current are dated by the shunt). A vibration of ±20 mN on 100 mN, touches of "
        "100 mN.",
        "",
        "| force | way | plan | true |",
        "|---|---|---|---|",
    ]
    bench = wired()
    for what, overrides, scene in rows():
        row = measured(load(scene, overrides, bench))
        lines.append(f"| {what} | {row} |")
        print(lines[-1], flush=True)
    text = "\n".join(lines) + "\n"
    tell(text, chosen.out)


def wired() -> Path:
    """The built-in bench, its scope's generator wired to the source."""
    built_in = resources.files("tactile_lab.scene").joinpath("simulated_bench.toml")
    bench = Path(tempfile.mkdtemp()) / "generator.toml"
    bench.write_text(built_in.read_text(encoding="utf-8") + "\n[coil.generator]\n")
    return bench


def rows() -> list[tuple[str, tuple[str, ...], str]]:
    """What is played, the overrides of its scene, and which that is."""
    found = []
    slow = ("record.sample_rate=100 kS/s",)
    for way in ("set-points", "list", "generator"):
        for hertz in (5, 10, 30, 50, 100, 150):
            lasts = max(0.4, 4 / hertz)
            keys = {
                "base": "100 mN", "amplitude": "20 mN", "count": 1, "rest": "0.2 s",
                "presentations_each": 1, "lowest": f"{hertz} Hz",
                "highest": f"{hertz} Hz", "lasts": f"{lasts} s",
            }  # fmt: skip
            told = tuple(f"protocol.{key}={value}" for key, value in keys.items())
            used = (*told, *slow, f"coil.way={way}")
            found.append((f"{hertz} Hz", used, "vibration"))
        for onset in (5, 8, 20, 100):
            keys = {"level": "100 mN", "repeats": 1, "rest": "0.2 s", "hold": "0.2 s"}
            told = tuple(f"protocol.{key}={value}" for key, value in keys.items())
            used = (*told, f'protocol.onsets=["{onset} ms"]', *slow, f"coil.way={way}")
            found.append((f"touch in {onset} ms", used, "touch"))
    return found


def measured(scene: Scene) -> str:
    """Way, and errors of the force, of one run."""
    commands: list[tuple[float, float]] = []
    usual = Electromagnet.command

    def heard(self: Electromagnet, time: float, target: float) -> bool:
        commands.append((time, target))
        return usual(self, time, target)

    Electromagnet.command = heard  # type: ignore[method-assign]
    try:
        with tempfile.TemporaryDirectory() as out:
            execution = Execution(scene, out)
            (used,) = ways_used(execution.plan.timeline.steps)
            done = execution.run()
            with Run.load(done.folder) as run:
                begun = float(run.trials["start"][0])
                # the run's zero on the bench's clock: both know when a list was sent
                zero = _zero(commands, run)
    finally:
        Electromagnet.command = usual  # type: ignore[method-assign]
    protocol = scene.protocol
    assert isinstance(protocol, Vibration | Touch)
    asked = next(iter(protocol.presentations())).force
    force = true_force(scene, commands, zero + begun - 0.1, asked.end + 0.2)
    best, least = 0.1, np.inf
    for reach, by in ((0.06, 1e-4), (1e-4, 2e-6)):
        shifts = best + np.arange(-reach, reach, by)
        errors = [error(asked, force, shift) for shift in shifts]
        best, least = float(shifts[np.argmin(errors)]), min(errors)
    return f"{used.way} | {100 * used.part:.2f} % | {100 * least:.2f} %"


def _zero(commands: list[tuple[float, float]], run: Run) -> float:
    """Clock time of the run's zero, s: of its last set-point but the ends' zeros."""
    rows = run.current
    moving = np.flatnonzero(np.abs(rows["setpoint"]) > 0.01)
    sent = [time for time, amperes in commands if abs(amperes) > 0.01]
    shunt = run.applied.steps
    first = shunt[np.flatnonzero(np.abs(shunt[:, 1]) > 0.01)[0], 0]
    assert moving.size
    return sent[0] - float(first)


def true_force(
    scene: Scene, commands: list[tuple[float, float]], start: float, lasts: float
) -> NDArray[np.float64]:
    """Force of the magnet under what the source played, N, every `STEP` s."""
    magnet = scene.bench.magnet
    coil = Electromagnet(coil_lag=magnet.coil_lag, eddy_lag=magnet.eddy_lag)
    found, waiting = [], sorted(commands)
    for time in start + STEP * np.arange(round(lasts / STEP)):
        while waiting and waiting[0][0] <= time:
            coil.command(*waiting.pop(0))
        found.append(coil.effective(float(time)))
    return magnet.force(np.array(found))


def error(asked: Waveform, force: NDArray[np.float64], after: float) -> float:
    """Largest difference, as a part of the range, if it began `after` s in."""
    wanted = asked.at(STEP * np.arange(force.size) - after)
    return float(np.abs(wanted - force).max() / np.ptp(asked.value))


if __name__ == "__main__":
    main()
