"""The header's chips: one per instrument the scene uses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gui.state import (
    CoilView,
    InstrumentView,
    Lamp,
    State,
    Truth,
    limit_text,
    milliamperes,
    truth,
)
from tactile_lab.quantity import show

if TYPE_CHECKING:
    from gui.session.core import Core
    from gui.session.expectation import Expectation

NAMES = {"coil": "Coil source", "scope": "Oscilloscope", "meter": "Teslameter"}


def instruments(session: Core, coil: CoilView | None) -> tuple[InstrumentView, ...]:
    """Chips of the instruments the planned scene needs, the model last."""
    roles = _roles(session)
    views = []
    for role in roles:
        if role == "coil":
            views.append(_coil(session, coil))
        elif role == "scope":
            views.append(_scope(session))
        elif role == "meter":
            views.append(_meter(session))
    if session.plan_on_screen is not None and session.plan_on_screen.preview.traces:
        views.append(_model(session, session.plan_on_screen))
    return tuple(views)


def _roles(session: Core) -> list[str]:
    expectation = session.plan_on_screen
    if expectation is None:
        found = session.bench.found if session.bench is not None else ()
        return [one.role for one in found] or ["coil", "scope"]
    needs = expectation.needs
    wanted = {
        "coil": needs.coil,
        "scope": bool(needs.channels),
        "meter": needs.field_meter or needs.asked_field,
    }
    return [role for role, used in wanted.items() if used]


def _found(session: Core, role: str) -> tuple[Lamp, str]:
    """Lamp and words of an instrument that is not in use now."""
    if session.state is State.CONNECTING:
        return Lamp.WAITING, "asking …"
    if session.bench is None:
        return Lamp.ABSENT, "no device"
    for one in session.bench.found:
        if one.role == role:
            return (Lamp.BAD, "no answer") if one.problem else (Lamp.GOOD, one.identity)
    return Lamp.GOOD, "opens when a run starts"


def _coil(session: Core, coil: CoilView | None) -> InstrumentView:
    what = truth(session.state, coil)
    if coil is None or what is Truth.NONE:
        lamp, words = _found(session, "coil")
        return InstrumentView(NAMES["coil"], lamp, words)
    lamp = {
        Truth.UNKNOWN: Lamp.BAD,
        Truth.LIVE: Lamp.ACTIVE,
        Truth.FALLING: Lamp.WAITING,
        Truth.OFF: Lamp.BAD if session.state is State.FAULT else Lamp.GOOD,
    }[what]
    value = "—" if coil.current is None else milliamperes(coil.current)
    if what is Truth.UNKNOWN:
        return InstrumentView(NAMES["coil"], lamp, "state unknown", "?")
    return InstrumentView(NAMES["coil"], lamp, limit_text(coil), value)


def _scope(session: Core) -> InstrumentView:
    lamp, words = _found(session, "scope")
    expectation, value = session.plan_on_screen, "idle"
    if lamp in (Lamp.ABSENT, Lamp.WAITING, Lamp.BAD):
        return InstrumentView(NAMES["scope"], lamp, words)
    if expectation is not None:
        rate = expectation.record.sample_rate
        count = len(expectation.needs.channels)
        words = f"{count} channel{'' if count == 1 else 's'} · 8 bit"
        if session.monitor.alive:
            lamp, value = Lamp.ACTIVE, "monitor"
        elif session.state is State.RUNNING:
            lamp, value = Lamp.ACTIVE, show(rate, "S/s", 3)
    return InstrumentView(NAMES["scope"], lamp, words, value)


def _meter(session: Core) -> InstrumentView:
    lamp, words = _found(session, "meter")
    meter = None if session.spec is None else session.spec.field_meter
    if meter is not None and meter.driver == "manual":
        words = "a person reads it"
    field = session.readings.get("field")
    value = "—" if field is None else show(round(field, 5), "T", 3)
    if session.state is State.RUNNING and field is not None:
        lamp = Lamp.ACTIVE
    return InstrumentView(NAMES["meter"], lamp, _short(words), value)


def _short(identity: str) -> str:
    """Maker and model of an ``*IDN?`` answer."""
    return " ".join(identity.split(",")[:2])


def _model(session: Core, plan: Expectation) -> InstrumentView:
    """What the model expects; beside a run, how well it follows."""
    lamp = Lamp.ACTIVE if session.state is State.RUNNING else Lamp.GOOD
    seen = session.agreement
    if seen is None and session.state is State.RUNNING and "V_C1" in plan.needs.stored:
        return InstrumentView("Model", lamp, "comparing …", "NRMSE —")
    if seen is None:
        expected = f"{plan.preview.spikes.size} spikes expected"
        return InstrumentView("Model", lamp, "preview in lanes", expected)
    if not seen.in_step:
        lamp = Lamp.WARNING
    words = "in step" if seen.in_step else "beside the run"
    return InstrumentView("Model", lamp, words, f"NRMSE {seen.text}")
