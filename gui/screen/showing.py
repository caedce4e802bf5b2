"""Which lanes are shown: those of what is on screen; what is left out has none."""

from __future__ import annotations

from gui.lanes.lane import Lane, lanes_for
from gui.lanes.source import Source
from gui.session.session import Session

WATCHED = ("V_C1", "V_C2", "V_K", "spikes")
"""What the monitor shows."""


def lanes_shown(session: Session, run: Source | None) -> tuple[Lane, ...] | None:
    """The lanes of the monitor, of `run` from disk, or of the plan; None: no plan."""
    if session.monitor.alive:
        return lanes_for(WATCHED, twin=False)
    if run is not None:
        return lanes_for(run.signals, twin=run.has_model)
    expectation = session.plan_on_screen
    if expectation is None:
        return None
    needs, record = expectation.needs, expectation.record
    signals = {"force", *needs.stored} | (set(record.signals) & {"spikes", "field"})
    if needs.detect_on is not None:
        signals.add("spikes")
    if "coil_current" not in record.signals:
        signals.discard("coil_current")
    return lanes_for(signals, twin=bool(expectation.preview.traces))
