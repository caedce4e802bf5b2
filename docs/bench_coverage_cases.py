"""The runs of docs/bench-coverage.md, and what is drawn for each.

What bench and sensor file have wrong is drawn from the uncertainty that they state, so
that the believed circuit is never the true one.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bench_coverage_told as told
import numpy as np
from bench_coverage_told import Told, Truth

from tactile_lab.analysis.belief import Belief
from tactile_lab.analysis.estimate import Z95
from tactile_lab.deviation import Deviation
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import TactileLabError
from tactile_lab.model.specimen import RESISTOR
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.run_data import RunData
from tactile_lab.scene.load import load
from tactile_lab.scope import CLOCK_ERROR
from tactile_lab.waveform import Waveform

GEOMETRY = 0.04
"""Half of the 95 % band of the force that the bench file states here."""


@dataclass(frozen=True)
class Case:
    """One scene, what is drawn for it, and what it tells with an interval.

    Attributes:
        scene: name of a shipped scene.
        changes: to it.
        told: numbers with interval and truth, of a run.
        code: of V_C1, V; the channel's offset is drawn within one.
        core: whether the width of the core's loop is drawn too, up to 50 mA.
        clock: standard deviation of the scope's clock, a part of itself.
        resistor: standard deviation of R1, a part of itself.
    """

    scene: str
    changes: tuple[str, ...]
    told: Callable[[RunData, dict[str, Any], Truth], Told]
    code: float = 4 / 254
    core: bool = False
    clock: float = 20e-6
    resistor: float = 0.0


def drawn(case: Case, seed: int) -> tuple[list[str], Deviation, float]:
    """Changes to the scene, what is wrong in its bench, and the core's loop, A."""
    rng = np.random.default_rng([seed, 2026])
    deviation = Deviation(
        input_bias=rng.normal(0, 20e-12 / Z95),
        offset=rng.normal(0, case.code / Z95),
        V_GS=rng.normal(0, 3e-3),
        force=rng.normal(0, GEOMETRY / Z95),
        lag=rng.normal(0, 1e-3 / Z95),
    )
    core = float(rng.uniform(0, 0.05)) if case.core else 0.0
    clock = _clock(rng, case.clock)
    deviation = replace(deviation, R1=rng.normal(0, case.resistor))
    units = {"input_bias": "A", "offset": "V", "V_GS": "V", "lag": "s"}
    changes = [
        f'simulated.deviation.{name}="{getattr(deviation, name)!r} {unit}"'
        for name, unit in units.items()
    ]
    return (
        [
            *changes,
            f"simulated.deviation.force={deviation.force!r}",
            f"simulated.deviation.R1={deviation.R1!r}",
            f"simulated.clock_error={clock!r}",
            f"simulated.seed={seed}",
            f'simulated.hysteresis="{core!r} A"',
            f"bench.magnet.geometry_uncertainty={GEOMETRY}",
        ],
        deviation,
        core,
    )


def _clock(rng: np.random.Generator, scatter: float) -> float:
    """Relative error of the scope's clock; beyond `CLOCK_ERROR` it would be refused."""
    return float(np.clip(rng.normal(0, scatter), -CLOCK_ERROR, CLOCK_ERROR))


CASES = {
    "hold, 150 mN, 10 s": Case(
        "hold_10s",
        ('record.signals=["V_K","spikes"]', 'protocol.rest="0.5 s"'),
        told.hold,
    ),
    "hold, 180 mN, 3 s": Case(
        "hold_10s",
        (
            'record.signals=["V_K","spikes"]',
            'protocol.rest="0.5 s"',
            'protocol.level="180 mN"',
            'protocol.hold="3 s"',
        ),
        told.hold,
    ),
    "bipolar, ±50 and 100 mN": Case(
        "bipolar",
        ('protocol.levels=["50 mN","-50 mN","100 mN"]',),
        told.bipolar,
        resistor=RESISTOR / Z95,
    ),
    "bipolar as shipped": Case("bipolar", (), told.bipolar, resistor=RESISTOR / Z95),
    "sine_sweep, 0.05 and 0.8 Hz": Case(
        "sine_sweep",
        ("protocol.count=2", 'protocol.lowest="0.05 Hz"', 'protocol.highest="0.8 Hz"'),
        told.sine_sweep,
    ),
    "rate_force, three forces": Case(
        "rate_force",
        (
            'record.signals=["V_K","spikes"]',
            'protocol.levels=["85 mN","120 mN","180 mN"]',
        ),
        told.rate_force,
    ),
    "wiring_check": Case("wiring_check", (), told.wiring),
    "calibrate_field": Case(
        "calibrate_field",
        ("protocol.points=7", "protocol.loops=1"),
        told.calibration,
        core=True,
    ),
    "force_check": Case("force_check", (), told.force_check),
    "threshold_search": Case(
        "threshold_search", ('record.signals=["V_K","spikes"]',), told.threshold
    ),
    "identify, demo": Case(
        "demo",
        ('record.signals=["V_C1","V_K","spikes"]',),
        told.identification,
        clock=CLOCK_ERROR / Z95,
    ),
    "identify, a minute with the shunt": Case(
        "demo",
        (
            'record.signals=["coil_current","V_C1","V_K","spikes"]',
            'protocol.levels=["120 mN","150 mN","180 mN","200 mN"]',
            'protocol.hold="9.5 s"',
            'protocol.rest="5 s"',
        ),
        told.identification,
        clock=CLOCK_ERROR / Z95,
    ),
    "demo": Case("demo", (), told.latencies),
    "touch": Case("touch", ("protocol.repeats=1",), told.touches),
    "threshold_trim": Case("threshold_trim", ("protocol.margin=0 N",), told.trimmed),
    "threshold_drift": Case(
        "threshold_drift",
        ("protocol.presses=20", "simulated.warming=0 K"),
        told.drifting,
    ),
    "monitor": Case("monitor", (), told.watched),
    "identify, demo with the shunt": Case(
        "demo",
        ('record.signals=["coil_current","V_C1","V_K","spikes"]',),
        told.identification,
        clock=CLOCK_ERROR / Z95,
    ),
    "identify, rate_force with the shunt": Case(
        "rate_force",
        (
            'record.signals=["coil_current","V_C1","V_K","spikes"]',
            'protocol.levels=["100 mN","140 mN","190 mN","120 mN"]',
        ),
        told.identification,
        clock=CLOCK_ERROR / Z95,
    ),
}


def repeat(name: str, seed: int) -> dict[str, Any]:
    """One run of a case: name, value, low, high and truth of each number it told."""
    case, began = CASES[name], time.process_time()
    changes, deviation, core = drawn(case, seed)
    scene = load(case.scene, [*case.changes, *changes])
    with tempfile.TemporaryDirectory() as scratch:
        run = read(Execution(scene, Path(scratch)).run().folder)
    bench, unmoved = scene.bench, Waveform.constant(0.0)
    believed = run.belief or Belief(
        scene.circuit, bench.magnet, unmoved, bench.followers
    )
    circuit, force = believed.deviating(deviation)
    assert isinstance(force, Waveform)  # that of an hour would come in pieces
    field = believed.magnet.B2_per_ampere, core
    true = Truth(circuit, force, 1 + deviation.force, field)
    numbers: list[tuple[str, float, float, float, float]] = []
    refused = ""
    try:
        findings = find(replace(run, belief=None))
        seen = replace(findings.run, belief=believed)
        numbers = list(case.told(seen, findings.conclusion.plain, true))
        refused = "" if numbers else "; ".join(findings.missing)
    except TactileLabError as reason:
        refused = str(reason)
    took = time.process_time() - began
    return {
        "case": name,
        "seed": seed,
        "told": numbers,
        "refused": refused,
        "cpu": took,
    }
