"""Runs of a protocol as the model answers them, without a bench."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from tactile_lab.analysis.belief import Belief
from tactile_lab.arrays import FloatArray
from tactile_lab.magnetics import Magnet
from tactile_lab.measurement import MeasuredTrial, RecordedSignal
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.plugins import protocol_class
from tactile_lab.report.run_data import RunData
from tactile_lab.waveform import Waveform

NEWTONS_PER_AMPERE = 0.2


MAGNET = Magnet(r=6e-3)

Step = tuple[str, float | None, Waveform, bool]
"""Label, level (N), force, and whether it is a pause."""


def means(found: Result, signal: str, time: FloatArray) -> FloatArray:
    """Of bins about these times, as a scope's samples give them."""
    step = time[1] - time[0]
    inside = time[:, None] + step * (np.arange(8) - 3.5) / 8
    average: FloatArray = found.sample(signal, inside).mean(axis=1)
    return average


def modelled(
    protocol: str,
    steps: Sequence[Step],
    *,
    circuit: Circuit | None = None,
    bins: int = 2000,
    parameters: Mapping[str, Any] | None = None,
    **entries: object,
) -> RunData:
    """A run of steps as the model answers them."""
    circuit = circuit or Circuit()
    force, starts = steps[0][2], [0.0]
    for _, _, wave, _ in steps[1:]:
        starts.append(force.end)
        force = force.then(wave)
    found = simulate(circuit, force, keep=("V_C1", "V_C2", "spikes"))
    time, spikes = (np.arange(bins) + 0.5) * force.end / bins, found.spike_times
    assert spikes is not None
    trials = []
    for start, (label, level, wave, pause) in zip(starts, steps, strict=True):
        inside = (spikes >= start) & (spikes < start + wave.end)
        trials.append(
            MeasuredTrial(
                label=label,
                level=level,
                start=start,
                duration=wave.end,
                spike_times=spikes[inside] - start,
                hold=None if level is None else (0.25, 0.25 + 1.0),
                pause=pause,
            )
        )
    traces = tuple(
        RecordedSignal(signal=s, time=time, mean=means(found, s, time))
        for s in ("V_C1", "V_C2")
    )
    plain: dict[str, Any] = {
        "title": protocol,
        "protocol": protocol_class(protocol)(**(parameters or {})),
        "run": "a run",
        "status": "complete",
        "simulated": True,
        "bench": "test",
        "duration": force.end,
        "trials": tuple(trials),
        "force": force,
        "current": np.column_stack([force.time, force.value / NEWTONS_PER_AMPERE]),
        "traces": traces,
        "circuit": Circuit(),
        "belief": Belief(
            Circuit(), MAGNET, force.scaled(1 / MAGNET.newtons_per_ampere)
        ),
    }
    return RunData(**{**plain, **entries})


def pulse(level: float, rest: float = 0.5) -> Step:
    label = f"{level * 1e3:g} mN"
    return (label, level, Waveform.pulse(level, ramp=0.25, hold=1.0, rest=rest), False)


def recovery(seconds: float = 50.0) -> Step:
    quiet = Waveform.through([(0.0, 0.0), (seconds, 0.0)])
    return ("recovery", None, quiet, True)


@pytest.fixture(scope="session")
def rate_force() -> RunData:
    steps = list[Step]()
    for level in (0.085, 0.11, 0.15, 0.2):
        steps += [pulse(level), recovery()]
    return modelled("rate_force", steps[:-1])
