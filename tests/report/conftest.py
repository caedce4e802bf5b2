"""One run's data computed by plain Euler steps of the paper's equations."""

import numpy as np
import pytest
from modelled_runs import rate_force

from protocols.pulses import Pulses
from tactile_lab.measurement import MeasuredTrial, RecordedSignal
from tactile_lab.report.run_data import Loss, RunData
from tactile_lab.waveform import Waveform

__all__ = ["rate_force"]

STEP = 2e-4


def euler(force, duration):
    """(time, V_C1, V_C2, spike times) of Table 1's circuit, good to a few ms."""
    k = 6 * 0.039 * 500e-9 * (7.7e-3 - 1.8e-3) / (2e-3 * 475e-6**2)
    n = int(duration / STEP)
    time = np.arange(n) * STEP
    drive = np.diff(force.at(np.append(time, duration))) * k
    v_p, v_1, v_2 = 0.0, 4.347038, 1.448
    V_T, R3 = 0.025, 100e6
    one, two, spikes = np.empty(n), np.empty(n), []
    for i in range(n):
        i_ds = 1.216e-12 * np.exp((1.4 + v_p) / (5.646 * V_T)) * -np.expm1(-v_1 / V_T)
        i_c = max(0.0, (5 - v_1 - 0.357) / R3)
        one[i], two[i] = v_1, v_2
        v_p += drive[i] - v_p / 8.69 * STEP
        v_1 += ((5 - v_1) / 9.58e6 - v_1 / 100e6 - i_ds) / 680e-12 * STEP
        v_2 += (i_c - v_2 / 500e6) / 150e-12 * STEP
        if v_2 >= 3.213:
            v_2 = 0.0
            spikes.append(time[i])
    return time, one, two, np.array(spikes)


def make_run(levels=(0.08, 0.12, 0.16, 0.2), *, ramp=0.25, hold=2.0, rest=2.0):
    length = 2 * ramp + hold + rest
    force = Waveform.pulse(levels[0], ramp=ramp, hold=hold, rest=rest)
    for level in levels[1:]:
        force = force.then(Waveform.pulse(level, ramp=ramp, hold=hold, rest=rest))
    duration = length * len(levels)
    time, v_1, v_2, spikes = euler(force, duration)
    rng = np.random.default_rng(1)
    bins = max(1, int(np.ceil(time.size / 4000)))
    usable = time.size // bins * bins

    def trace(signal, values):
        noisy = values[:usable] + rng.normal(0, 4e-3, usable)
        cells = noisy.reshape(-1, bins)
        middle = time[:usable].reshape(-1, bins).mean(axis=1)
        return RecordedSignal(
            signal=signal,
            time=middle,
            mean=cells.mean(axis=1),
            low=cells.min(axis=1),
            high=cells.max(axis=1),
        )

    trials = []
    for i, level in enumerate(levels):
        start = i * length
        mine = spikes[(spikes >= start) & (spikes < start + length)] - start
        trials.append(
            MeasuredTrial(
                label=f"{level * 1e3:g} mN",
                level=level,
                start=start,
                duration=length,
                spike_times=mine,
                hold=(ramp, ramp + hold),
            )
        )
    return RunData(
        title="Force pulses",
        protocol=Pulses(),
        scene="demo",
        run="2026-11-21_demo",
        started="2026-11-21 02:00",
        status="complete",
        simulated=True,
        bench="built-in simulated bench",
        duration=duration,
        took=4.21,
        trials=tuple(trials),
        force=force,
        current=np.column_stack([force.time, force.value * 5]),
        traces=(trace("V_C1", v_1), trace("V_C2", v_2)),
        loss=Loss(
            samples_produced=72_000_000,
            samples_stored=72_000_000,
            spikes_online=47,
            spikes=0,
            sentence="loss: 0 of 72000000 samples, 0 of 47 spikes",
        ),
        accuracy="Spike times of the simulation are within 2e-10 s of the model's "
        "exact solution (estimated).",
        warnings=("V_K at 1 MS/s gives counts and times to ±1 µs, not amplitudes.",),
        assumptions=("r = 6 mm and B2 = 11 mT/A: 200 mN/A with A2 as printed.",),
        parameters={"levels": "80 mN, 120 mN, 160 mN, 200 mN", "hold": "2 s"},
        sensor={"V_GS": "1.4 V", "tau": "8.69 s"},
        settings={
            "coil": {"identity": "KEPCO,BIT 4886", "compliance": "8 V"},
            "scope": {"identity": "PicoScope 3404D", "interval": "1 µs"},
        },
        calibration={"B1": "163 mT", "r": "6 mm"},
        environment={"tactile-lab": "0.1.0"},
    )


@pytest.fixture(scope="session")
def demo():
    return make_run()


@pytest.fixture(scope="session")
def run_maker():
    return make_run
