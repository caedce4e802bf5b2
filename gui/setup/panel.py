"""The left panel: protocol, preview, form, estimate, Run, Queue."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QScrollArea, QWidget

from gui.look.theme import Theme
from gui.parts import (
    SCROLL_BAR,
    STRETCH,
    IconButton,
    column,
    label,
    line,
    row,
    say,
    scrolling,
    set_role,
    stack,
    with_gutter,
)
from gui.session.log import Severity
from gui.session.queue import Queued
from gui.session.session import Session
from gui.setup.buttons import Buttons
from gui.setup.estimate import EstimateView
from gui.setup.form import Form
from gui.setup.parameter import FieldError
from gui.setup.picker import Picker, about
from gui.setup.preset_button import PresetButton
from gui.setup.preview import WaveformPreview
from gui.setup.queue import QueueView
from gui.setup.sections import Sections
from gui.setup.subject import Subject
from gui.state import Snapshot, run_problem
from gui.tab_order import reach
from tactile_lab.engine.request import Request
from tactile_lab.errors import TactileLabError

LOW, TIGHT = 660, 570
"""Heights of the panel, px, below which the queue shows less of fewer runs, and scrolls
with the form: it stood over the form's fields and buttons."""

NAMED = 4
"""Changed parameters in the name of a run."""

SETTLE, SECOND = 250, 1000
"""Time without a keystroke before the plan is computed anew, and from one word on one
that is not there yet to the next, ms."""

WARNINGS, TALL = 3, 800
"""Warnings shown where the panel is so high, px, else one; the tool tip has them all,
and the log as the run begins."""


class SetupPanel(QFrame):
    """What the next run will do."""

    scene_wanted = Signal()

    def __init__(self, session: Session, theme: Theme) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName("Protocol")
        self.setMinimumWidth(304)
        self._session, self._theme = session, theme
        self._snapshot = Snapshot()
        self._in_progress = self._names = False
        self._refused = ""
        self._once_planned: Callable[[], None] | None = None
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(SETTLE)
        self._timer.timeout.connect(self.plan_now)
        self._waits = QTimer(self, interval=SECOND)
        self._waits.timeout.connect(self._wait_on)
        self.picker = Picker()
        self.strip = label("", "strip", wrap=True)
        self.strip.hide()
        self.about = label("", "muted", wrap=True)
        self.preview = WaveformPreview(theme)
        self.form = Form()
        self.tables = Sections(theme, self.form.edits)
        self.warnings = label("", "warning", wrap=True)
        self.warnings.hide()
        self.rests_on = label("", "small", wrap=True)
        self.subject = Subject(session, self.form, self.tables)
        self.star = PresetButton(
            theme, self.form, session.out.resolve().parent / "presets", self.request
        )
        self.estimate = EstimateView()
        self.problem = label("", "error", wrap=True)
        self.buttons = Buttons(theme)
        self.run = self.buttons.run
        self.queue = QueueView(theme)
        self._lay_out()
        self._connect()

    def _connect(self) -> None:
        session, queue, buttons = self._session, self.queue, self.buttons
        self.picker.picked.connect(self._picked)
        self.form.changed.connect(self._form_changed)
        self.tables.changed.connect(self._form_changed)
        session.bench.ready.connect(self.subject.follow_bench)
        self.subject.changed.connect(self._show_subject)
        self.star.failed.connect(lambda words: say(self.problem, words))
        buttons.run.clicked.connect(self.start)
        buttons.queue.clicked.connect(self.enqueue)
        buttons.save.clicked.connect(self.save)
        buttons.cancel.clicked.connect(self.cancel)
        queue.edited.connect(self.edit)
        queue.removed.connect(session.queue.remove)
        queue.moved.connect(session.queue.move)
        queue.resumed.connect(session.start_queue)
        session.queue.changed.connect(self._show_queue)
        session.plan.arrived.connect(self._planned)
        session.stopped.connect(self._wait_no_more)

    # --- scenes ---------------------------------------------------------------------

    def open_scene(self, path: str | None, overrides: tuple[str, ...] = ()) -> None:
        """Put a scene into the form.

        Raises:
            SceneError: it cannot be used.
        """
        self.subject.open(path, overrides)

    @property
    def kind_name(self) -> str:
        """Name of the protocol in the form."""
        return "" if self.form.protocol is None else self.form.protocol.name

    def request(self) -> Request:
        """What the form asks for.

        Raises:
            FieldError: a field cannot be used.
        """
        return self.subject.request()

    # --- plan, run, queue -------------------------------------------------------------

    def plan_now(self) -> None:
        """Have the form's run planned."""
        self._timer.stop()
        if self._mistake:
            self._show_problem(self._mistake)
            return
        try:
            self._session.plan.make(self.request())
            self._waits.start()
        except FieldError as error:
            self._show_problem(str(error))

    def start(self) -> None:
        """Run what the form says, as soon as that is planned."""
        if not self._is_refused(self._prevented) and self._is_planned(self.start):
            self._session.start(
                self.request(), self.title, self._session.plan.expectation
            )

    def start_when_planned(self) -> None:
        """Have the plan that is being computed run, unless something is in its way."""
        self._session.plan.expectation = None
        self._once_planned = self.start

    def enqueue(self) -> None:
        """Have it follow the run in progress; an edited run is saved instead."""
        if self.subject.edited is not None:
            self.save()
        elif not self._is_refused(self._cannot_wait) and self._is_planned(self.enqueue):
            expectation = self._session.plan.expectation
            self._session.queue.add(Queued(self.title, self.request(), expectation))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as much of the queue as leaves room for the form."""
        super().resizeEvent(event)
        tight = self.height() <= TIGHT
        self.queue.show_room(low=self.height() <= LOW, scrolls=tight)
        self._hint.setVisible(not tight)
        if tight and self._inside.indexOf(self.queue) < 0:
            self._inside.insertWidget(0, self.queue)
        elif not tight and self._whole.indexOf(self.queue) < 0:
            self._whole.addWidget(self.queue, self._queue_at, 0)

    def edit(self, item: Queued) -> None:
        """Take up a waiting run's parameters into the form."""
        before = self.subject.edited
        problem = self.subject.edit(item)
        if self.subject.edited is not before:
            self._names = item.title == self.title
        if problem:
            self._show_strip(problem, warning=True)
        elif self.form.fields:
            first = self.form.fields[0]
            QTimer.singleShot(0, first, lambda: reach(first))  # it has its place then

    def save(self) -> None:
        """Replace the edited run's parameters, as soon as they are planned."""
        item, plan = self.subject.edited, self._session.plan.expectation
        if item is None or self._is_refused(self._unusable):
            return
        if not self._is_planned(self.save):
            return
        assert plan is not None
        asked = self.title if self._names else item.title, self.request(), plan
        self.subject.leave()
        self._session.queue.replace(item, *asked)
        self.queue.focus_on(item)

    def cancel(self) -> None:
        """Leave the edited run as it is."""
        item = self.subject.edited
        self.subject.leave()
        if item is not None:
            self.queue.focus_on(item)

    @property
    def title(self) -> str:
        """Name of the run to be: its protocol, and what is changed of that."""
        kind = self.form.protocol
        if kind is None:
            return "Run"
        own = [value.text for value in self.form.values if value.is_changed]
        return " · ".join((kind.title, *own[:NAMED]))

    def render_snapshot(self, snapshot: Snapshot) -> None:
        """Say what the form shows, and why a button is off."""
        self._snapshot = snapshot
        self._forget_refusal()
        busy = snapshot.state.in_run
        self._in_progress = busy and self._shows_run_in_progress()
        editing = self.subject.edited is not None
        planning = self._session.plan.lasts if snapshot.bench else ""
        self.picker.setEnabled(not editing)
        told = self.subject.words(busy=busy, shown=self._in_progress)
        self._show_strip(told, warning=bool(told) and told == self.subject.lost)
        if editing:
            self.buttons.show_edit(self._unusable, planning)
        else:
            waits = {"cannot_wait": self._cannot_wait, "planning": planning}
            self.buttons.show_next(snapshot.state, self._blocked(), **waits)

    def show_head(self, time: float | None) -> None:
        """Put the preview's play-head, where it shows the run in progress."""
        self.preview.show_head(time if self._in_progress else None)

    @property
    def _unusable(self) -> str:
        """Why the form cannot be used, "" if it can."""
        return self._mistake or self._session.plan.problem

    @property
    def _cannot_wait(self) -> str:
        """Why the form's run cannot wait in the queue, "" if it can."""
        alone = self._session.bench.choice is None
        return "No bench is connected." if alone else self._unusable

    @property
    def _mistake(self) -> str:
        """Why what stands in the fields cannot be used, "" if it can."""
        return self.form.problem or self.tables.problem

    @property
    def _prevented(self) -> str:
        """Why a run cannot start, also once it is planned, "" if it can."""
        if self.subject.edited is not None:
            return "Save or cancel the changes to the queued run first."
        return run_problem(self._snapshot, form_problem=self._unusable)

    def _blocked(self) -> str:
        """Why a run cannot start now, "" if it can."""
        unplanned = self._session.plan.expectation is None
        wait = "The plan is being computed: a long run's takes seconds."
        return self._prevented or (wait if unplanned else "")

    def _is_refused(self, problem: str) -> bool:
        """Whether something is in the way of what a key asks for: that is told.

        A button is locked then, and its tool tip says why; a key has neither.
        """
        if problem:
            self._refused = problem
            self._session.log.tell(Severity.WARNING, "form", problem)
        return bool(problem)

    def _forget_refusal(self) -> None:
        """What was in the way of a key is so no more."""
        ways = (self._prevented, self._cannot_wait, self._unusable)
        if self._refused and self._refused not in ways:
            self._refused = ""
            self._session.log.told.emit("")

    def _wait_on(self) -> None:
        """The plan is not there yet: say so, and nothing of the one before."""
        if self._session.plan.request != self.request():
            self.preview.show_preview(None)
            self.estimate.show_estimate(None)
        self.render_snapshot(self._snapshot)

    def _is_planned(self, then: Callable[[], None]) -> bool:
        """Whether the plan is that of the form; if not, `then` follows it."""
        plan = self._session.plan
        if plan.request != self.request() or plan.expectation is None:
            self.plan_now()
            self._once_planned = then
            return False
        return True

    def _wait_no_more(self) -> None:
        """STOP: what would begin once it is planned does not."""
        if self._once_planned == self.start:
            self._once_planned = None

    def _planned(self) -> None:
        self._waits.stop()
        expectation = self._session.plan.expectation
        self._show_problem(self._session.plan.problem)
        self.star.mark()
        if expectation is not None:
            self.preview.show_preview(expectation.preview)
            self._show_warnings(expectation.warnings)
            say(self.rests_on, _listed(expectation.assumptions))
            self.estimate.show_estimate(expectation.estimate)
        self.render_snapshot(self._snapshot)
        then, self._once_planned = self._once_planned, None
        if then is not None:
            then()

    def _show_problem(self, problem: str) -> None:
        self._session.plan.problem = problem
        say(self.problem, problem)
        if problem:
            self.preview.show_preview(None, problem)
            self.estimate.show_estimate(None)
            self._show_warnings(())

    # --- what is shown ----------------------------------------------------------------

    def _form_changed(self) -> None:
        self._once_planned, self.subject.lost = None, ""
        self._session.plan.forget()
        self._waits.stop()
        self._show_problem(self._mistake)
        self._timer.start()
        self.render_snapshot(self._snapshot)

    def _show_subject(self) -> None:
        """Another protocol, or another run, is in the form."""
        kind = self.form.protocol
        if kind is not None:
            self.picker.show_protocol(kind)
            self.about.setText(about(kind))
        self._show_queue()
        self.plan_now()

    def _show_queue(self) -> None:
        session = self._session
        self.queue.show_queue(
            session.queue.items, held=session.queue.held, edited=self.subject.edited
        )
        self.render_snapshot(self._snapshot)

    def _shows_run_in_progress(self) -> bool:
        """Whether the form holds what the run in progress was asked to do."""
        if self.subject.edited is not None or self._mistake:
            return False
        return self.request() == self._session.run.request

    def _picked(self, scene: str) -> None:
        try:
            self.subject.pick(scene)
        except TactileLabError as error:
            self._show_problem(str(error))

    def _show_strip(self, words: str, *, warning: bool) -> None:
        """Say above the form whose parameters it shows; "" says nothing."""
        set_role(self.strip, "strip-warn" if warning else "strip")
        say(self.strip, words)

    def _show_warnings(self, warnings: Sequence[str]) -> None:
        """Show where the run would not be what is asked for."""
        shown = warnings[: WARNINGS if self.height() >= TALL else 1]
        left = len(warnings) - len(shown)
        more = f" (and {left} more)" if left else ""
        say(self.warnings, "\n".join(f"⚠ {text}" for text in shown) + more)
        self.warnings.setToolTip("\n".join(warnings))

    def _page(self) -> QScrollArea:
        """The part that scrolls: what the run is, its force, its parameters."""
        axes = label("mN against s", "small")
        caption = row(label("WAVEFORM", "section"), STRETCH, axes, spacing=6)
        inner, title = QWidget(), label("PARAMETERS", "section")
        force = (self.about, caption, self.preview)
        rests_on = (label("NUMBERS REST ON", "section"), self.rests_on)
        asked = (title, self.form, self.tables, *rests_on)
        self._inside = column(inner, *force, *asked, STRETCH, spacing=9)
        return with_gutter(scrolling(inner), self._inside)

    def _lay_out(self) -> None:
        self.help = IconButton(self._theme, "help", "Help on this panel")
        self._open = IconButton(self._theme, "file", "Open a scene (Ctrl+O)")
        self._open.clicked.connect(self.scene_wanted)
        self._reset = IconButton(self._theme, "undo", "Reset to defaults")
        self._reset.clicked.connect(self.form.reset)
        title = label("Protocol", "title")
        head = row(title, STRETCH, self.star, self._open, self._reset, self.help)
        self.problem.hide()
        page = self._page()
        self._hint = label("Drop a <b>scene</b> or a <b>run</b> anywhere", "small")
        parts = (
            head,
            self.picker,
            self.strip,
            page,
            self.queue,
            self.problem,
            self.warnings,
            line(),
            self.estimate,
            self.buttons,
            self._hint,
        )
        self._queue_at = parts.index(self.queue)
        self._whole = stack(self, parts, page)
        self._whole.setContentsMargins(14, 10, 14 - SCROLL_BAR, 12)


def _listed(texts: Sequence[str]) -> str:
    """Sentences that begin as headings do, one a line."""
    return "\n".join(f"{text[:1].upper()}{text[1:]}" for text in texts)
