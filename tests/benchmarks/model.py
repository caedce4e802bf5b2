"""The model's speed: ratios within one run. `python tests/benchmarks/model.py`."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.validation import general
from tactile_lab.validation.accuracy import accuracy_scenes
from tactile_lab.validation.problem import spent as cpu_time
from tactile_lab.waveform import Waveform


def least(action: Callable[[], object], repeats: int) -> float:
    """Least wall time of several calls, s."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return min(times)


def start_up(code: str) -> float:
    """Least wall time of a new Python process, s."""
    return least(lambda: subprocess.run([sys.executable, "-c", code], check=True), 4)


def million() -> Waveform:
    """A force of a million segments over 100 s."""
    time = np.linspace(0.0, 100.0, 1_000_001)
    return Waveform(time, 0.15 * np.abs(np.sin(time)))


FIRST = """
from tactile_lab.model.simulate import simulate
from tactile_lab.model.circuit import Circuit
from tactile_lab.waveform import Waveform
simulate(Circuit(saturation={saturation}), Waveform.constant(0.2), until=1.0)
"""


def first_call(saturation: bool) -> float:
    """CPU time of a process that has to compile, s."""
    with tempfile.TemporaryDirectory() as cache:
        before = cpu_time()
        subprocess.run(
            [sys.executable, "-c", FIRST.format(saturation=saturation)],
            check=True, env={**os.environ, "NUMBA_CACHE_DIR": cache},
        )  # fmt: skip
        return cpu_time() - before


def main() -> None:
    """Print one line per goal."""
    sensor, silent = Circuit(), Waveform.constant(0.0)
    print("against CVODE Adams at 1e-9 (least of several, interleaved):")
    for scene in accuracy_scenes()[:6]:
        own, other = [], []
        for _ in range(3):
            own.append(
                least(
                    partial(simulate, scene.circuit, scene.force, until=scene.until), 20
                )
            )
            other.append(least(partial(general.cvode, scene, "Adams", 1e-9, 60.0), 1))
        print(
            f"  {scene.name:9s} ours {min(own) * 1e3:7.3f} ms, CVODE "
            f"{min(other) * 1e3:8.1f} ms, ratio {min(other) / min(own):.0f}"
        )
    scene = accuracy_scenes()[1]
    found = simulate(scene.circuit, scene.force, until=scene.until, keep=("V_C1",))
    spent = least(
        lambda: simulate(scene.circuit, scene.force, until=13.0, keep=("V_C1",)), 50
    )
    steps = found.stages["V_C1"]
    print(f"per step of V_C1, all included: {spent / steps * 1e6:.1f} us ({steps})")
    clamped = Circuit(saturation=True, tau=1e9)
    jump = Waveform.through([(0, 0), (0.1, 0), (0.1, 0.195)])
    found = simulate(clamped, jump, until=1.1)
    assert found.spike_times is not None
    spent = least(lambda: simulate(clamped, jump, until=1.1), 20)
    print(
        f"T1 saturates: {spent / found.stages['V_C1'] * 1e6:.0f} us a step, "
        f"{spent / found.spike_times.size * 1e6:.0f} us a spike"
    )
    many = simulate(sensor, million(), until=100.0)
    spent = least(lambda: simulate(sensor, million(), until=100.0), 3)
    print(f"a million segments: {spent / many.stages['V_P'] * 1e6:.1f} us each")
    fast = Circuit(C2=1e-15, V_GS=2.0)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.perf_counter()
    many = simulate(fast, silent, until=0.8, keep=("statistics",))
    spent = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    statistics = many.solution.statistics
    assert statistics is not None
    print(
        f"{statistics.count} spikes counted in {spent:.2f} s: "
        f"{spent / statistics.count * 1e6:.2f} us a spike, "
        f"{(after - before) / 1024:.1f} MB more memory"
    )
    short = least(lambda: simulate(sensor, silent, until=10.0), 50)
    long = least(lambda: simulate(sensor, silent, until=1e6), 50)
    print(f"1e6 s of silence over 10 s of silence: {long / short:.2f}")
    numba = start_up("import numba")
    first = start_up(FIRST.format(saturation=False))
    print(
        f"new process: import numba {numba:.2f} s, first simulation {first:.2f} s, "
        f"beyond numba {first - numba:.2f} s"
    )
    print(
        f"first call after installation: {first_call(False):.1f} s of CPU time, "
        f"{first_call(True):.1f} s where T1 saturates"
    )


if __name__ == "__main__":
    main()
