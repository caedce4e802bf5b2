"""Spikes that the mains make, as a report warns of them."""

from __future__ import annotations

from tactile_lab.analysis.phase_locking import mains_locking
from tactile_lab.store.run import Run


def told(run: Run) -> tuple[str, ...]:
    """What to say of spikes that keep to the phase of the mains; empty if none do."""
    found = mains_locking(run.spikes["time"])
    if found is None:
        return ()
    return (
        f"The {found.spikes} spikes looked at keep to one phase of the mains, "
        f"{found.mains:g} Hz (vector strength {found.strength:.2f}, more than at any "
        "frequency around): hum makes them, or moves them. Counts, latencies and rates "
        "may be its own. Compare detect.threshold with the hum of V_K (`tactile-lab "
        "run wiring_check`), and shield the gate and its leads.",
    )
