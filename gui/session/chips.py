"""The header's chips: one per instrument the scene uses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gui.session.bench import ROLES, ConnectedBench
from gui.session.heard import Heard
from gui.session.live_monitor import LiveMonitor
from gui.session.live_run import LiveRun
from gui.session.status import Status
from gui.state import (
    CoilKnowledge,
    CoilView,
    InstrumentView,
    Lamp,
    WindowState,
    ago,
    limit_text,
    milliamperes,
    truth,
)
from tactile_lab.quantity import show
from tactile_lab.voltage_source import SOURCED

if TYPE_CHECKING:
    from gui.session.expectation import Expectation


class Chips:
    """Says of each instrument what it does, from what the session's parts know."""

    def __init__(
        self, status: Status, bench: ConnectedBench, run: LiveRun, monitor: LiveMonitor
    ) -> None:
        self._status, self._bench = status, bench
        self._run, self._monitor = run, monitor

    def views(
        self, plan: Expectation | None, coil: CoilView | None
    ) -> tuple[InstrumentView, ...]:
        """Chips of the instruments the plan on screen needs, the model last."""
        views = [
            InstrumentView("Coil left", Lamp.BAD, f"{port}: state unknown", "?")
            for port in self._status.coil.left_unknown
        ]
        for role in self._roles(plan):
            if role == "coil":
                views.append(self._coil(coil))
            elif role == "scope":
                views.append(self._scope(plan))
            elif role == "meter":
                views.append(self._meter())
            elif role == "thermometer":
                views.append(self._thermometer())
            elif plan is not None:
                views.append(self._voltage(role, plan.needs.voltages[role]))
        if plan is not None and plan.preview.traces:
            views.append(self._model(plan))
        return tuple(views)

    def _roles(self, plan: Expectation | None) -> list[str]:
        if plan is None:
            found = [one.role for one in self._bench.answers]
            return [one for one in found if one not in SOURCED] or ["coil", "scope"]
        needs = plan.needs
        wanted = {
            "coil": needs.coil,
            "scope": bool(needs.channels),
            "meter": needs.field_meter or needs.asked_field,
            "thermometer": needs.thermometer,
            **dict.fromkeys(needs.voltages, True),
        }
        return [role for role, used in wanted.items() if used]

    def _found(self, role: str) -> tuple[Lamp, str]:
        """Lamp and words of an instrument that is not in use now."""
        if self._status.state is WindowState.CONNECTING:
            return Lamp.WAITING, "asking …"
        if self._status.state is WindowState.ABORTING:  # which it may be the reason of
            return Lamp.WAITING, "the run is being stopped"
        here = [one for one in self._bench.answers if one.role == role]
        if self._status.state is WindowState.DISCONNECTED or not here:
            return Lamp.ABSENT, "no device"
        if self._bench.age is None:
            return Lamp.WAITING, "not asked since the fault"
        if here[0].problem:
            return Lamp.BAD, "no answer"
        if not self._bench.known:
            return Lamp.WAITING, f"answered {self._bench.age / 60:.0f} min ago"
        return Lamp.GOOD, here[0].identity

    def _coil(self, coil: CoilView | None) -> InstrumentView:
        state, name = self._status.state, ROLES["coil"]
        what = truth(state, coil)
        if coil is None or what in (CoilKnowledge.NONE, CoilKnowledge.ASKED):
            return InstrumentView(name, *self._found("coil"))
        idle, words = self._found("coil")
        lamp = {
            CoilKnowledge.UNKNOWN: Lamp.BAD,
            CoilKnowledge.LIVE: Lamp.ACTIVE,
            CoilKnowledge.FALLING: Lamp.WAITING,
            CoilKnowledge.OFF: idle,
            CoilKnowledge.WAS_OFF: Lamp.WAITING if idle is Lamp.GOOD else idle,
        }[what]
        value = "—" if coil.current is None else milliamperes(coil.current)
        sent = coil.setpoint is not None
        if what is CoilKnowledge.LIVE and coil.told is None and sent:
            value = f"→ {milliamperes(coil.setpoint)}"
        if what is CoilKnowledge.UNKNOWN:
            return InstrumentView(name, lamp, "state unknown", "?")
        if what is CoilKnowledge.WAS_OFF:
            return InstrumentView(name, lamp, f"off, read back {ago(coil)}", "—")
        if what is CoilKnowledge.OFF and not self._bench.known:
            return InstrumentView(name, lamp, words, value)
        return InstrumentView(name, lamp, limit_text(coil), value)

    def _scope(self, plan: Expectation | None) -> InstrumentView:
        lamp, words = self._found("scope")
        value = "idle"
        if lamp in (Lamp.ABSENT, Lamp.WAITING, Lamp.BAD):
            return InstrumentView(ROLES["scope"], lamp, words)
        if plan is not None:
            rate = plan.record.sample_rate
            count = len(plan.needs.channels)
            words = f"{count} channel{'' if count == 1 else 's'} · 8 bit"
            if self._monitor.alive:
                heard = self._monitor.answered.get("scope")
                lamp, words, value = _in_use(heard, words, "monitor")
            elif self._status.state is WindowState.RUNNING:
                heard = self._run.answered.get("scope")
                lamp, words, value = _in_use(heard, words, show(rate, "S/s", 3))
        return InstrumentView(ROLES["scope"], lamp, words, value)

    def _meter(self) -> InstrumentView:
        lamp, words = self._found("meter")
        spec, field = self._bench.spec, self._run.field
        meter = None if spec is None else spec.field_meter
        by_person = meter is not None and meter.driver == "manual"
        words = "a person reads it" if by_person else _maker_and_model(words)
        value = "—"
        if self._status.state is WindowState.RUNNING and field is not None:
            lamp, value = Lamp.ACTIVE, show(round(field, 5), "T", 3)
            if not by_person:  # who reads when asked, and is never late
                heard = self._run.answered.get("meter")
                lamp, words, value = _in_use(heard, words, value)
        return InstrumentView(ROLES["meter"], lamp, words, value)

    def _thermometer(self) -> InstrumentView:
        lamp, words = self._found("thermometer")
        words = _maker_and_model(words)
        value, kelvin = "—", self._run.kelvin
        if self._status.state is WindowState.RUNNING and kelvin is not None:
            heard = self._run.answered.get("thermometer")
            lamp, words, value = _in_use(heard, words, show(kelvin, "K", 5))
        return InstrumentView(ROLES["thermometer"], lamp, words, value)

    def _voltage(self, name: str, wanted: float) -> InstrumentView:
        """What the source of a voltage is to hold, V, and what it holds in a run."""
        lamp, words = self._found(name)
        value, held = "—", self._run.voltages.get(name)
        if lamp not in (Lamp.ABSENT, Lamp.WAITING, Lamp.BAD):
            words = f"to hold {show(wanted, 'V', 5)}"
        if self._status.state is WindowState.RUNNING and held is not None:
            heard = self._run.answered.get(name)
            lamp, words, value = _in_use(heard, words, show(held, "V", 5))
        return InstrumentView(ROLES[name], lamp, words, value)

    def _model(self, plan: Expectation) -> InstrumentView:
        """What the model expects; beside a run, how well it follows."""
        running = self._status.state is WindowState.RUNNING
        lamp = Lamp.ACTIVE if running else Lamp.GOOD
        seen = self._run.agreement
        if seen is None and running and "V_C1" in plan.needs.stored:
            return InstrumentView("Model", lamp, "comparing …", "NRMSE —")
        if seen is None:
            expected = f"{plan.preview.spikes.size} spikes expected"
            return InstrumentView("Model", lamp, "preview in lanes", expected)
        if not seen.in_step:
            lamp = Lamp.WARNING
        words = "in step" if seen.in_step else "beside the run"
        return InstrumentView("Model", lamp, words, f"NRMSE {seen.text}")


def _in_use(heard: Heard | None, words: str, value: str) -> tuple[Lamp, str, str]:
    """Lamp, words and value of what a task uses, as long as its last word says so."""
    if heard is None:
        return Lamp.WAITING, "not heard yet", "—"
    if heard.pauses:
        return Lamp.GOOD, "pauses as planned", "idle"
    if heard.overdue:
        return Lamp.WAITING, f"silent for {heard.silent:.0f} s", "—"
    return Lamp.ACTIVE, words, value


def _maker_and_model(answer: str) -> str:
    """Maker and model of an answer to *IDN?."""
    return " ".join(answer.split(",")[:2])
