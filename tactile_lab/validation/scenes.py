"""The committed scenes of the accuracy report, from easy to stiff."""

from __future__ import annotations

from tactile_lab.model.circuit import Circuit
from tactile_lab.validation.problem import Problem
from tactile_lab.waveform import Waveform


def _four_pulses() -> Waveform:
    points = [(0.0, 0.0)]
    for k, level in enumerate((0.08, 0.12, 0.16, 0.2)):
        t = 4.5 * k
        points += [
            (t + 0.25, level), (t + 2.25, level), (t + 2.5, 0.0), (t + 4.5, 0.0)
        ]  # fmt: skip
    return Waveform.through(points)


def accuracy_scenes() -> tuple[Problem, ...]:
    """Seven scenes, from easy to stiff."""
    table = Circuit()
    return (
        Problem(
            "pulses", table, _four_pulses(), 18.0,
            note="the demo: 80, 120, 160, 200 mN, 0.25 s ramps",
        ),
        Problem(
            "hold150", table,
            Waveform.through(
                [(0, 0), (1, 0), (1.01, 0.15), (11, 0.15), (11.01, 0), (13, 0)]
            ),
            13.0, note="150 mN for 10 s, 10 ms ramps",
        ),
        Problem(
            "fig5b", Circuit(V_GS=1.54141),
            Waveform.through([(0, 0), (5, 0), (5.01, 0.05), (105, 0.05)]),
            105.0, note="50 mN for 100 s, close to threshold",
        ),
        Problem(
            "jump270", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 0.27)]), 2.5,
            note="a jump to 270 mN, V_C1 starts to collapse",
        ),
        Problem(
            "jump300", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 0.3)]), 2.5,
            note="a jump to 300 mN, V_C1 collapses",
        ),
        Problem(
            "jump400", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 0.4)]), 2.5,
            note="a jump to 400 mN, rate of V_C1 8e4 /s",
        ),
        Problem(
            "jump1000", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 1.0)]), 2.5,
            note="a jump to 1 N, rate of V_C1 7e7 /s",
        ),
    )  # fmt: skip
