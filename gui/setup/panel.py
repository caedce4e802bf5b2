"""The left panel: protocol, preview, form, estimate, Run, Queue."""

from __future__ import annotations

import inspect
from pathlib import Path

from PySide6.QtCore import QTimer, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QComboBox, QFrame, QHBoxLayout, QVBoxLayout, QWidget

from gui.look.icons import icon, pixmap
from gui.look.theme import Theme
from gui.parts import IconButton, column, elided, label, line, push, scrolling
from gui.session.messages import Planned
from gui.session.request import Request
from gui.session.session import Queued, Session
from gui.setup.estimate import EstimateView
from gui.setup.form import Form
from gui.setup.preset_button import PresetButton
from gui.setup.preview import WaveformPreview
from gui.setup.queue import QueueView
from gui.setup.texts import FieldError
from gui.state import Snapshot, State, run_problem
from tactile_lab.errors import TactileLabError
from tactile_lab.plugins import protocol_class, protocol_names, scene_path
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene

SETTLE = 250
"""Milliseconds without a keystroke before the plan is computed anew."""


class SetupPanel(QFrame):
    """What the next run will do."""

    scene_wanted = Signal()

    def __init__(self, session: Session, theme: Theme) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName("Protocol")
        self.setMinimumWidth(304)
        self._session, self._theme = session, theme
        self._path: str | None = None
        self._snapshot = Snapshot()
        self._start_planned = False
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(SETTLE)
        self._timer.timeout.connect(self.plan_now)
        self.picker = QComboBox()
        self.picker.setAccessibleName("Protocol")
        self.picker.setMaxVisibleItems(20)
        self.about = label("", "muted", wrap=True)
        self.source = label("", "small")
        self.preview = WaveformPreview(theme)
        self.form = Form()
        self.star = PresetButton(
            theme, self.form, session.out.resolve().parent / "presets", self.request
        )
        self.estimate = EstimateView()
        self.problem = label("", "error", wrap=True)
        self.warnings = label("", "warning", wrap=True)
        self.run = push("Run", "primary")
        self.queue_button = push("Queue")
        self.queue = QueueView(theme)
        self._lay_out()
        self.picker.activated.connect(self._picked)
        self.form.changed.connect(self._form_changed)
        self.star.failed.connect(self._show_problem)
        self.run.clicked.connect(self.start)
        self.queue_button.clicked.connect(self.enqueue)
        self.queue.removed.connect(session.unqueue)
        self.queue.moved.connect(session.move_queued)
        self.queue.resumed.connect(session.resume_queue)
        session.queue_changed.connect(
            lambda: self.queue.show_queue(session.queue, held=session.queue_held)
        )
        session.planned.connect(self._planned)
        theme.changed.connect(self._tint)
        self._tint()

    # --- scenes ---------------------------------------------------------------------

    def open_scene(self, path: str | None, overrides: tuple[str, ...] = ()) -> None:
        """Put a scene into the form.

        Raises:
            SceneError: it cannot be used.
        """
        scene = load(None if path is None else Path(path), overrides)
        self._path = path
        self._fill_picker(scene)
        kind = type(scene.protocol)
        values = {key: getattr(scene.protocol, key) for key in kind.model_fields}
        self.form.show_protocol(kind, values)
        self._describe()
        self.plan_now()

    def show_protocol(self, name: str) -> None:
        """Show a protocol with its ready scene, else with its defaults."""
        ready = scene_path(name)
        if ready.is_file():
            self.open_scene(name)
            return
        self.open_scene(inspect.getfile(protocol_class(name)))

    @property
    def kind_name(self) -> str:
        """Name of the protocol in the form."""
        return "" if self.form.protocol is None else self.form.protocol.name

    def request(self) -> Request:
        """What the form asks for.

        Raises:
            FieldError: a field cannot be used.
        """
        session = self._session
        overrides = (*self.form.overrides(), *session.bench_overrides)
        return Request(self._path, overrides, session.bench_choice)

    # --- plan, run, queue -------------------------------------------------------------

    def plan_now(self) -> None:
        """Have the form's run planned."""
        self._timer.stop()
        if self.form.problem:
            self._show_problem(self.form.problem)
            return
        try:
            self._session.plan(self.request())
        except FieldError as error:
            self._show_problem(str(error))

    def start(self) -> None:
        """Run what the form says."""
        if self._blocked():
            return
        self._session.start(self.request(), self.title, self._session.expectation)

    def start_when_planned(self) -> None:
        """Have the plan that is being computed run, unless something is in its way."""
        self._session.expectation = None
        self._start_planned = True

    def enqueue(self) -> None:
        """Have it follow the run in progress."""
        if self.form.problem or self._session.plan_problem:
            return
        expectation = self._session.expectation
        self._session.enqueue(Queued(self.title, self.request(), expectation))

    @property
    def title(self) -> str:
        """Name of the run to be."""
        kind = self.form.protocol
        return "Run" if kind is None else kind.title

    def render_snapshot(self, snapshot: Snapshot) -> None:
        """Lock the form and say why Run is off."""
        self._snapshot = snapshot
        locked = snapshot.state in (State.RUNNING, State.ABORTING)
        self.form.lock(locked)
        self.picker.setEnabled(not locked)
        self._reset.setEnabled(not locked)
        self.star.setEnabled(not locked)
        reason = self._blocked()
        self.run.setEnabled(not reason)
        self.run.setToolTip(reason or "Run what the form says (Ctrl+R)")
        words = {State.RUNNING: "Running …", State.ABORTING: "Stopping …"}
        self.run.setText(words.get(snapshot.state, "Run"))
        can_queue = not self.form.problem and not self._session.plan_problem
        self.queue_button.setEnabled(
            can_queue and snapshot.state is not State.DISCONNECTED
        )

    def show_head(self, time: float | None) -> None:
        """Put the preview's play-head."""
        self.preview.show_head(time)

    def _blocked(self) -> str:
        problem = self.form.problem or self._session.plan_problem
        if not problem and self._session.expectation is None:
            problem = "The plan is being computed."
        return run_problem(self._snapshot, form_problem=problem)

    def _planned(self, planned: Planned) -> None:
        expectation = planned.expectation
        self._show_problem(planned.problem)
        self.star.mark()
        if expectation is not None:
            self.preview.show_preview(expectation.preview)
            self.estimate.show_estimate(expectation.estimate)
            self.warnings.setText(
                "\n".join(f"⚠ {text}" for text in expectation.warnings[:3])
            )
            self.warnings.setToolTip("\n".join(expectation.warnings))
            self.warnings.setVisible(bool(expectation.warnings))
        self.render_snapshot(self._snapshot)
        if self._start_planned:
            self._start_planned = False
            self.start()

    def _show_problem(self, problem: str) -> None:
        self._session.plan_problem = problem
        self.problem.setText(problem)
        self.problem.setVisible(bool(problem))
        if problem:
            self.preview.show_preview(None, problem)
            self.estimate.show_estimate(None)
            self.warnings.hide()

    def _form_changed(self) -> None:
        self._start_planned = False
        if self.form.problem:
            self._show_problem(self.form.problem)
        self._timer.start()
        self.render_snapshot(self._snapshot)

    def _picked(self, index: int) -> None:
        try:
            self.show_protocol(str(self.picker.itemData(index)))
        except TactileLabError as error:
            self._show_problem(str(error))

    def _fill_picker(self, scene: Scene) -> None:
        names = list(protocol_names())
        if scene.protocol.name not in names:
            names.append(scene.protocol.name)
        if [self.picker.itemData(i) for i in range(self.picker.count())] != names:
            self.picker.clear()
            for name in names:
                own = name == scene.protocol.name
                kind = type(scene.protocol) if own else protocol_class(name)
                self.picker.addItem(kind.title, name)
        self.picker.setCurrentIndex(names.index(scene.protocol.name))

    def _describe(self) -> None:
        kind = self.form.protocol
        first = ((kind.__doc__ or "") if kind else "").strip().split("\n\n")[0]
        self.about.setText(" ".join(first.replace("`", "").split()))
        name = "demo" if self._path is None else Path(self._path).name
        elided(self.source, f"scene: {name}")

    def _lay_out(self) -> None:
        self.help = IconButton(self._theme, "help", "Help on this panel")
        self._open = IconButton(self._theme, "folder", "Open a scene (Ctrl+O)")
        self._open.clicked.connect(self.scene_wanted)
        self._reset = IconButton(self._theme, "undo", "Reset to defaults")
        self._reset.clicked.connect(self.form.reset)
        head = QHBoxLayout()
        head.addWidget(label("Protocol", "title"))
        head.addStretch(1)
        head.addWidget(self.star)
        head.addWidget(self._open)
        head.addWidget(self._reset)
        head.addWidget(self.help)
        buttons = QHBoxLayout()
        buttons.setSpacing(8)
        buttons.addWidget(self.run, 3)
        buttons.addWidget(self.queue_button, 2)
        inner = QWidget()
        middle = column(inner, spacing=9)
        middle.addWidget(self.about)
        caption = QHBoxLayout()
        caption.addWidget(label("WAVEFORM", "section"))
        caption.addStretch(1)
        caption.addWidget(label("mN against s", "small"))
        middle.addLayout(caption)
        middle.addWidget(self.preview)
        middle.addWidget(label("PARAMETERS", "section"))
        middle.addWidget(self.form)
        middle.addWidget(self.warnings)
        middle.addStretch(1)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(14, 10, 14, 12)
        whole.setSpacing(8)
        whole.addLayout(head)
        whole.addWidget(self.picker)
        whole.addWidget(scrolling(inner), 1)
        whole.addWidget(self.problem)
        whole.addWidget(line())
        whole.addWidget(self.estimate)
        whole.addLayout(buttons)
        whole.addWidget(self.queue)
        self._drop = label("Drop a <b>scene</b> or a <b>run</b> anywhere", "small")
        whole.addWidget(self._drop)
        self.problem.hide()
        self.warnings.hide()

    def _tint(self) -> None:
        tokens = self._theme.tokens
        play = icon("play", tokens.on_accent)
        play.addPixmap(pixmap("play", tokens.faint), QIcon.Mode.Disabled)
        self.run.setIcon(play)
        self.queue_button.setIcon(icon("queue", tokens.text))
