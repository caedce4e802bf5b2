"""How fast the plant solves and renders the demo: 18 s of experiment.

Run ``python tests/benchmarks/plant_rendering.py [repeats]``. Wall and CPU seconds of
the rendering thread, medians; the first line includes what is compiled or loaded.
"""

from __future__ import annotations

import statistics
import sys
import time

import numpy as np

BEGIN = time.perf_counter()

from sim_backend.plant import sensor  # noqa: E402
from sim_backend.plant.options import PlantOptions  # noqa: E402
from sim_backend.plant.plant import Plant  # noqa: E402
from sim_backend.plant.render import digitise, noise_table  # noqa: E402
from tactile_lab.magnetics import Magnet  # noqa: E402
from tactile_lab.model.advance import advance  # noqa: E402
from tactile_lab.model.circuit import Circuit  # noqa: E402
from tactile_lab.scope import Channel  # noqa: E402
from tactile_lab.waveform import Waveform  # noqa: E402

DURATION = 18.0
CHANNELS = (
    Channel(signal="V_C1", input="A", range=2.0, offset=-2.5),
    Channel(signal="V_C2", input="B", range=2.0, offset=-1.7),
    Channel(signal="V_K", input="C", range=5.0),
    Channel(signal="coil_current", input="D", range=0.2, scale=10.0),
)


def demo() -> Waveform:
    """Force of the demo scene, N: four magnitudes, 0.25 s ramps, 2 s hold and rest."""
    force = Waveform.pulse(0.08, ramp=0.25, hold=2.0, rest=2.0)
    for level in (0.12, 0.16, 0.2):
        force = force.then(Waveform.pulse(level, ramp=0.25, hold=2.0, rest=2.0))
    return force


def play(
    channels: tuple[Channel, ...] = CHANNELS,
    *,
    rate: float = 1e6,
    block: float = 0.02,
    update: float = 0.031,
    options: PlantOptions | None = None,
) -> tuple[float, float, float]:
    """Render the demo; wall, CPU and solver seconds."""
    magnet = Magnet(r=6e-3)
    times = np.arange(0.01, DURATION, update)
    levels = demo().at(times) / magnet.newtons_per_ampere
    solving = [0.0]
    real = advance

    def timed(*args: object, **rest: object) -> object:
        began = time.thread_time()
        answer = real(*args, **rest)  # type: ignore[arg-type]
        solving[0] += time.thread_time() - began
        return answer

    vars(sensor)["advance"] = timed
    wall, cpu = time.perf_counter(), time.thread_time()
    try:
        plant = Plant(Circuit(), magnet, options, 1)
        plant.output(0.0, True)
        total, size, j = round(DURATION * rate), round(block * rate), 0
        for first in range(0, total, size):
            n = min(size, total - first)
            while j < times.size and times[j] <= (first + n) / rate:
                plant.set_current(float(times[j]), float(levels[j]))
                j += 1
            plant.render(first, n, 1 / rate, 0.0, channels, 32512, 8)
    finally:
        vars(sensor)["advance"] = real
    return time.perf_counter() - wall, time.thread_time() - cpu, solving[0]


def kernel() -> float:
    """Nanoseconds a sample of the kernel alone, 100 samples a piece."""
    n = 2_000_000
    start = np.arange(0, 2.0, 1e-4)
    value, slope = np.sin(start), np.cos(start)
    codes, noise = np.empty(n, dtype=np.int16), noise_table(1)
    common = (0, 0.0, 1e-6, start, value, slope, noise, 1, 1e-4, 0.0, 50.0, 127, 8)
    digitise(codes, *common)
    began = time.thread_time()
    digitise(codes, *common)
    return (time.thread_time() - began) / n * 1e9


def main(repeats: int) -> None:
    """Print the table."""
    print(f"import, first time compiled: {time.perf_counter() - BEGIN:.2f} s")
    print(f"kernel alone: {kernel():.2f} ns a sample")
    cases: dict[str, dict[str, object]] = {
        "4 channels, 1 MS/s, 20 ms blocks": {},
        "4 channels, 1 MS/s, 5 ms blocks": {"block": 0.005},
        "4 channels, 1 MS/s, 200 ms blocks": {"block": 0.2},
        "with hum": {"options": PlantOptions(hum=5e-3)},
        "with hysteresis": {"options": PlantOptions(hysteresis=0.05)},
        "200 set-points a second": {"update": 0.005},
        "V_C1 only": {"channels": CHANNELS[:1]},
        "shunt only": {"channels": CHANNELS[3:]},
        "4 channels, 7.8 MS/s": {"rate": 7.8125e6},
    }
    print(f"{'18 s of experiment':36}  first   wall    CPU   of it solving, s")
    for name, case in cases.items():
        first = play(**case)[0]  # type: ignore[arg-type]
        runs = [play(**case) for _ in range(repeats)]  # type: ignore[arg-type]
        wall, cpu, solving = (
            statistics.median(column) for column in zip(*runs, strict=True)
        )
        print(f"{name:36} {first:6.2f} {wall:6.2f} {cpu:6.2f} {solving:6.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
