"""What the window shows: one state, one snapshot, and the words on STOP. No Qt here."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from tactile_lab.quantity import printed, show

STALE = 1.5
"""Seconds without a word from a live coil's source after which its state is unknown."""

HOLDS = 120.0
"""Seconds after which an answer no longer says that an instrument is there, nor that
an output is off."""

LAGS, MOVED = 0.3, 5e-3
"""Age of a read-back, s, from which on it says nothing of a set-point that has moved
by so much since, A."""


IN_THE_WINDOW = {
    "with --out": "in Settings",
    "run `tactile-lab recover` on this run": "recover this run in Runs",
    "`": "",
}
"""Words of a terminal, and what a window has for them."""


def unmarked(text: str) -> str:
    """A message as a window says it: no back-ticks, options or verbs of a terminal."""
    for theirs, ours in IN_THE_WINDOW.items():
        text = text.replace(theirs, ours)
    return text


class WindowState(Enum):
    """The one state of the window."""

    DISCONNECTED = "no bench"
    CONNECTING = "connecting"
    READY = "ready"
    RUNNING = "running"
    ABORTING = "stopping"
    FAULT = "fault"

    @property
    def in_run(self) -> bool:
        """Whether a run is in progress, be it one that is being stopped."""
        return self in (WindowState.RUNNING, WindowState.ABORTING)


class CoilKnowledge(Enum):
    """What is known about the coil, from read-back, never from commands."""

    NONE = "none"
    ASKED = "asked"
    OFF = "off"
    WAS_OFF = "was off"
    LIVE = "live"
    FALLING = "falling"
    UNKNOWN = "unknown"


class Lamp(Enum):
    """Lamps differ in shape as well as in colour."""

    ABSENT = "absent"
    WAITING = "waiting"
    GOOD = "good"
    ACTIVE = "active"
    WARNING = "warning"
    BAD = "bad"


@dataclass(frozen=True)
class CoilView:
    """The coil as last read back.

    Attributes:
        output: whether the output is on, or was told to go on; None if nobody knows.
        current: read back, A; None if never read.
        setpoint: last sent, A; None where the output was just told to go on.
        age: of the source's last acknowledgement, s.
        read_age: of the read-back, s.
        under: set-point that stood when it was read back, A.
        verified_off: result of the last switching off; None before any.
        limit: largest current allowed, A.
    """

    output: bool | None
    current: float | None = None
    setpoint: float | None = None
    age: float = 0.0
    read_age: float = 0.0
    under: float | None = None
    verified_off: bool | None = None
    limit: float | None = None

    @property
    def told(self) -> float | None:
        """What is known to flow, A; None where it was read too long ago to say.

        A moving set-point leaves a read-back behind within moments, one that stands
        does not.
        """
        moved = abs((self.setpoint or 0.0) - (self.under or 0.0)) > MOVED
        return None if self.read_age > (LAGS if moved else STALE) else self.current


@dataclass(frozen=True)
class InstrumentView:
    """One instrument chip.

    Attributes:
        name: for people.
        lamp: its state.
        detail: identity, limit or what is wrong.
        value: live value as text; "—" where there is none.
    """

    name: str
    lamp: Lamp
    detail: str = ""
    value: str = "—"

    @property
    def short(self) -> str:
        """The name where there is little room."""
        known = {
            "Coil source": "Coil",
            "Oscilloscope": "Scope",
            "Teslameter": "Field",
            "Thermometer": "Temp",
        }
        return known.get(self.name, self.name.removeprefix("Source of "))


@dataclass(frozen=True)
class FaultNotice:
    """What went wrong, and what to do now."""

    title: str
    consequence: str


@dataclass(frozen=True)
class Snapshot:
    """Everything the header, banner and buttons are rendered from.

    Attributes:
        state: the window's state.
        bench: name of the bench, "" without one.
        simulated: whether the bench is simulated.
        title: of the run or whatever else is on screen; "" before any.
        opened: how many runs from disk are on screen.
        coil: what is known about the coil; None without a coil source.
        left_unknown: ports of coils of other benches that nobody could verify off.
        instruments: chips, in order; only those the scene uses.
        elapsed: run time reached, s.
        expected: run time expected, s; None if unknown.
        manual: the coil is driven by hand.
        known: the instruments answered lately; else nobody knows whether they do.
        queued: titles of the runs that wait; only this window has them.
        notes: those kept for the next run; only this window has them.
        fault: unacknowledged fault.
    """

    state: WindowState = WindowState.DISCONNECTED
    bench: str = ""
    simulated: bool = False
    title: str = ""
    opened: int = 0
    coil: CoilView | None = None
    left_unknown: tuple[str, ...] = ()
    instruments: tuple[InstrumentView, ...] = field(default=())
    elapsed: float = 0.0
    expected: float | None = None
    manual: bool = False
    known: bool = True
    queued: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    fault: FaultNotice | None = None

    @property
    def heading(self) -> str:
        """What is looked at, for a person."""
        if self.opened:
            return f"{'Looking at' if self.opened == 1 else 'Comparing'} {self.title}"
        return self.title or self.bench or "No bench connected"


def truth(state: WindowState, coil: CoilView | None) -> CoilKnowledge:
    """What may be claimed about the coil.

    A live coil whose source has been silent for longer than `STALE` is unknown, and so
    is one whose switching off could not be verified. One that was verified off longer
    than `HOLDS` ago was off then; one of a bench that is being connected is asked.
    """
    if coil is None:
        return CoilKnowledge.NONE
    never = coil.output is None and coil.verified_off is None
    if never and state is WindowState.CONNECTING:
        return CoilKnowledge.ASKED
    if coil.output is None or (not coil.output and coil.verified_off is False):
        return CoilKnowledge.UNKNOWN
    if not coil.output:
        old = coil.read_age > HOLDS
        return CoilKnowledge.WAS_OFF if old else CoilKnowledge.OFF
    if coil.age > STALE:
        return CoilKnowledge.UNKNOWN
    return (
        CoilKnowledge.FALLING if state is WindowState.ABORTING else CoilKnowledge.LIVE
    )


def stop_truth(
    state: WindowState, coil: CoilView | None, left_unknown: tuple[str, ...]
) -> CoilKnowledge:
    """What STOP claims: where the coil is at rest, of those that were left unknown."""
    what = truth(state, coil)
    driven = what in (CoilKnowledge.LIVE, CoilKnowledge.FALLING)
    return CoilKnowledge.UNKNOWN if left_unknown and not driven else what


def left_notice(left_unknown: tuple[str, ...]) -> FaultNotice | None:
    """What is to be read of coils that were left unknown; None where none was."""
    if not left_unknown:
        return None
    return FaultNotice(
        f"Coil state unknown at {' and '.join(left_unknown)}.",
        "It may still be driven, and this bench cannot switch it off. Switch it off at "
        "the source, or connect its bench again.",
    )


@dataclass(frozen=True)
class StopText:
    """The two lines on STOP, and the whole as one sentence for screen readers."""

    title: str
    detail: str

    @property
    def spoken(self) -> str:
        """One line for assistive technology."""
        return f"{self.title}: {self.detail}"


def milliamperes(current: float | None) -> str:
    """A current as "374 mA", with a true minus; never "−0 mA"."""
    if current is None:
        return "not read"
    number = round(current * 1e3)
    return printed(f"{number} mA")


def stop_text(
    state: WindowState, coil: CoilView | None, left_unknown: tuple[str, ...] = ()
) -> StopText:
    """What STOP says, from the read-back."""
    what = stop_truth(state, coil, left_unknown)
    if what is CoilKnowledge.UNKNOWN:
        return StopText("COIL STATE UNKNOWN", "switch off at the source")
    if what is CoilKnowledge.NONE or coil is None:
        return StopText("STOP", "no coil source")
    if what is CoilKnowledge.ASKED:
        return StopText("STOP", "asking the coil source")
    now = milliamperes(coil.current)
    if what is CoilKnowledge.WAS_OFF:
        return StopText("STOP", f"{now} read back {ago(coil)}")
    if what is CoilKnowledge.FALLING:
        return StopText("STOPPING", f"{now} → 0")
    if what is CoilKnowledge.LIVE:
        if coil.told is None:
            sent = "switched on"
            if coil.setpoint is not None:
                sent = f"{milliamperes(coil.setpoint)} sent"
            return StopText("STOP · COIL OFF", f"{sent}, not read back")
        return StopText("STOP · COIL OFF", f"{now} live")
    if state is WindowState.FAULT:
        return StopText("COIL IS OFF", f"{now} verified")
    return StopText("STOP", f"coil is off · {now}")


def ago(coil: CoilView) -> str:
    """When a coil was read back, as "5 min ago"."""
    return f"{coil.read_age / 60:.0f} min ago"


def run_problem(snapshot: Snapshot, *, form_problem: str) -> str:
    """Why a run cannot start now, "" if it can."""
    if snapshot.state is WindowState.DISCONNECTED:
        return "No bench is connected."
    if snapshot.state is WindowState.CONNECTING:
        return "The bench is still connecting."
    if snapshot.state is WindowState.RUNNING:
        return "A run is in progress; use Queue to have this one follow."
    if snapshot.state is WindowState.ABORTING:
        return "The run is being stopped."
    if snapshot.state is WindowState.FAULT:
        return "Acknowledge the fault first."
    if snapshot.manual:
        return "The coil is driven by hand; switch it off first."
    return form_problem


def clock_text(snapshot: Snapshot) -> tuple[str, str]:
    """The state in capitals and the clock below it."""
    word = {
        WindowState.DISCONNECTED: "NO BENCH",
        WindowState.CONNECTING: "CONNECTING",
        WindowState.READY: "READY",
        WindowState.RUNNING: "RUNNING",
        WindowState.ABORTING: "STOPPING",
        WindowState.FAULT: "FAULT",
    }[snapshot.state]
    if snapshot.manual:
        return "BY HAND", "the coil is in use"
    if snapshot.state is WindowState.DISCONNECTED:
        return word, "connect to start"
    if snapshot.state is WindowState.CONNECTING:
        return word, "asking the instruments"
    elapsed = minutes(snapshot.elapsed, tenths=True)
    if snapshot.state.in_run:
        if snapshot.expected is None:
            return word, elapsed
        return word, f"{elapsed} / {minutes(snapshot.expected)}"
    if snapshot.state is WindowState.FAULT:
        return word, "acknowledge to go on"  # it need not be of the last run
    if not snapshot.known:
        return word, "nobody answered lately"
    if truth(snapshot.state, snapshot.coil) is CoilKnowledge.WAS_OFF:
        return word, "STOP reads it back"  # nobody else may ask some sources
    return word, f"last run {elapsed}" if snapshot.elapsed else "coil off"


def minutes(seconds: float, *, tenths: bool = False) -> str:
    """A duration as mm:ss, mm:ss.t or h:mm:ss."""
    parts = round(max(0.0, seconds) * (10 if tenths else 1))
    whole, tenth = divmod(parts, 10) if tenths else (parts, 0)
    hours, rest = divmod(whole, 3600)
    text = f"{rest // 60:02d}:{rest % 60:02d}"
    if hours:
        return f"{hours}:{text}"
    return f"{text}.{tenth}" if tenths else text


def limit_text(coil: CoilView | None) -> str:
    """The coil chip's second line."""
    if coil is None:
        return "no device"
    on = {True: "output on", False: "output off", None: "state unknown"}[coil.output]
    return on if coil.limit is None else f"{on} · ≤ {show(coil.limit, 'A', 3)}"
