"""Studies short enough to be carried out whole, many times."""

from pathlib import Path
from typing import Any

from tactile_lab.studies.carry_out import StudyProgress, carry_out
from tactile_lab.studies.dataset import Gathered
from tactile_lab.studies.study import Study

SHORT = {
    "scene": "demo",
    "set": {
        "protocol.levels": ["200 mN"],
        "protocol.hold": "300 ms",
        "protocol.rest": "50 ms",
    },
    "keep": ["spike_count", "first_spike", "spike_times", "critical_force"],
}


LEVELS = {
    **SHORT,
    "axis": [
        {"key": "sensor.V_GS", "values": "1.38 V : 1.42 V : 20 mV"},
        {"key": "sensor.R1", "normal": "1 %"},
    ],
    "draw": {"points": 5},
}


def done(asked: Study, out: Path, **how: Any) -> tuple[Gathered, list[StudyProgress]]:
    told: list[StudyProgress] = []
    return carry_out(asked, out, tell=told.append, **{"count": 1, **how}), told


def same(one: Gathered, other: Gathered) -> bool:
    return one.to_xarray().identical(other.to_xarray())
