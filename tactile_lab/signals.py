"""The signals a scene may record, where each comes from, and its unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Source = Literal["measured", "derived", "model"]
DAGGER = "†"
"""Behind a number of spikes that are not all counted."""
NO_COUNT = f"{DAGGER}: seen, no count of the spikes there were."
"""Below where it stands."""


@dataclass(frozen=True)
class Signal:
    """One recordable signal.

    Attributes:
        name: as written in scenes and files.
        unit: SI.
        source: where a run gets it from, which has none that are of the model;
            `simulate` computes all but bench signals.
        title: for axes and legends.
    """

    name: str
    unit: str
    source: Source
    title: str


SIGNALS = {
    signal.name: signal
    for signal in (
        Signal("force", "N", "derived", "Force"),
        Signal("coil_current", "A", "measured", "Coil current"),
        Signal("field", "T", "measured", "Field"),
        Signal("temperature", "K", "measured", "Temperature"),
        Signal("V_P", "V", "model", "V_P"),
        Signal("I_DS", "A", "derived", "I_DS"),
        Signal("V_C1", "V", "measured", "V_C1"),
        Signal("I_C", "A", "model", "I_C"),
        Signal("V_C2", "V", "measured", "V_C2"),
        Signal("V_K", "V", "measured", "V_K"),
        Signal("spikes", "s", "derived", "Spikes"),
        Signal("rate", "Hz", "derived", "Rate"),
    )
}

BENCH_ONLY = frozenset({"coil_current", "field", "temperature"})
"""Signals the model alone knows nothing of."""

MODEL_ONLY = frozenset(n for n, signal in SIGNALS.items() if signal.source == "model")
"""Signals that no instrument has: `simulate` gives them, and no run."""

AVERAGED = ("field", "temperature")
"""Kept as readings, one for many samples, where a scope channel carries them."""

FIELD_AVERAGING = 0.2
"""Time one reading is averaged over, s: whole periods of 50 Hz and of 60 Hz mains."""
