"""All lanes above each other, linked in time, with the navigator below."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, Qt, Signal
from PySide6.QtWidgets import QFrame

from gui.lanes.arrangement import Arrangement, resized
from gui.lanes.box import LaneBox
from gui.lanes.card import LaneAct
from gui.lanes.floor import LaneContext
from gui.lanes.lane import Lane, lanes_for
from gui.lanes.navigator import Navigator
from gui.lanes.readings import Painted
from gui.lanes.row import LaneRow
from gui.lanes.scene import LaneScene
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.parts import column, lines, row
from gui.plots.numbers import number
from gui.popup_menu import Menu
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    from tactile_lab.store.statistics import SignalStatistics

STEPS = 40
"""Most steps that the menu offers to jump to."""

STEP = 12.0
"""By how much a key makes a lane higher, px."""


class LaneStack(QFrame):
    """The lanes of one source: cards, and beside them their plots in one scene."""

    export_asked = Signal()
    threshold_asked = Signal(float)
    """Spikes of the next run shall be counted from this level of V_K, V, on."""
    source_changed = Signal()
    arranged = Signal()
    """Lanes were moved, resized or hidden by hand."""

    def __init__(self, view: TimeView, theme: Theme) -> None:
        super().__init__()
        self.view = view
        self.stage = LaneContext(view, tokens=theme.tokens)
        self.scene = LaneScene(self.stage, self._places)
        self.rows: list[LaneRow] = []
        self.navigator = Navigator(view, theme)
        self.show_residual = True
        self.arrangement = Arrangement()
        self._theme = theme
        self._cards = lines(spacing=0)
        lanes = row(self._cards, spacing=0)
        lanes.addWidget(self.scene, 1)
        self._whole = column(self, (lanes, 1), self.navigator, spacing=0)
        view.beside = self._ranges
        view.changed.connect(self.refresh)
        view.cursors_changed.connect(self.show_values)
        self.scene.drawn.connect(self._follow_picture)
        self.scene.menu_asked.connect(self._ask)
        self.scene.threshold_dragged.connect(self.threshold_asked)
        theme.changed.connect(self._tint)

    @property
    def source(self) -> Source:
        """What is shown."""
        return self.stage.source

    def show_lanes(self, lanes: Sequence[Lane]) -> None:
        """Show these lanes."""
        wanted = self.arrangement.ordered(lanes)
        if [one.lane for one in self.rows] == wanted:
            return
        before = {one.lane: one for one in self.rows}
        self.rows = [before.get(lane) or self._made(lane) for lane in wanted]
        for gone in (one for one in before.values() if one.lane not in wanted):
            for widget in (gone.card, gone.rule):
                widget.hide()
                self._cards.removeWidget(widget)
                widget.deleteLater()
        self._stack_cards()
        self.arrange()

    def _made(self, lane: Lane) -> LaneRow:
        made = LaneRow(lane, self.stage, self._theme)
        made.card.resized.connect(partial(self._resize, made))
        made.card.moved.connect(partial(self.move_lane, made))
        made.card.dropped.connect(self.arranged)
        made.card.acted.connect(partial(self._act, made))
        made.card.menu_asked.connect(partial(self._ask_by_key, made))
        made.card.installEventFilter(self)
        return made

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Have the plots follow their cards, which may be laid out after a frame."""
        if event.type() in (QEvent.Type.Move, QEvent.Type.Resize):
            self.scene.refresh()
        return False

    def _stack_cards(self) -> None:
        """Put cards and plots in the order of the rows."""
        for one in self.rows:  # a widget that is added again goes to the end
            self._cards.addWidget(one.card)
            self._cards.addWidget(one.rule)
        self.scene.show_boxes([one.box for one in self.rows])

    def show_source(self, source: Source) -> None:
        """Show another source in the same lanes."""
        self.view.spike = None
        for one in self.rows:
            one.box.forget()
        self.exchange_source(source)

    def exchange_source(self, source: Source) -> None:
        """Show another source of the same data: ranges stay."""
        self.stage.source = self.navigator.source = source
        for one in self.rows:
            one.box.painted = Painted()
            one.tint()
        self.refresh()
        self.show_values()
        self.source_changed.emit()

    def _ranges(self) -> Callable[[], None]:
        """Note the lanes' ranges; the answer shows them again."""
        kept = {one.lane.key: (*one.box.shown, one.box.locked) for one in self.rows}

        def show() -> None:
            for one in self.rows:
                if one.lane.key in kept:
                    low, high, locked = kept[one.lane.key]
                    one.box.show_between(low, high, locked=locked)

        return show

    def hide_lane(self, key: str, hidden: bool) -> None:
        """Hide or show one lane."""
        shown = self.arrangement.hidden
        (shown.add if hidden else shown.discard)(key)
        self.arrange()
        self.arranged.emit()

    def move_lane(self, which: LaneRow, way: int) -> None:
        """Let a lane change places with the next above (-1) or below (1) on screen."""
        shown = self.visible_rows()
        at = shown.index(which) + way
        if not 0 <= at < len(shown):
            return
        one, other = self.rows.index(which), self.rows.index(shown[at])
        self.rows[one], self.rows[other] = self.rows[other], self.rows[one]
        self.arrangement.put([one.lane.key for one in self.rows])
        self._stack_cards()
        self.arrange()

    def _resize(self, which: LaneRow, by: float) -> None:
        """Make a lane higher by so many px, at the cost of those below."""
        shown = self.visible_rows()
        at = shown.index(which)
        if at + 1 < len(shown):
            heights = resized([one.card.height() for one in shown], at, by)
            self.arrangement.resize([one.lane for one in shown], heights)
            self.arrange()
            self._whole.activate()  # the next move of the pointer goes on from there

    def forget_arrangement(self) -> None:
        """Give the lanes the order and the heights of the beginning."""
        self.arrangement.forget()
        self.arranged.emit()
        lanes = lanes_for({row.lane.key for row in self.rows})
        self.show_lanes([lane for lane in lanes if self.row(lane.key)])
        self.arrange()

    def arrange(self) -> None:
        """Show what is wanted; the lowest visible lane carries the time axis."""
        for one in self.rows:
            wanted = not self.is_hidden(one.lane.key)
            if one.lane.key == "residual":
                wanted = wanted and self.show_residual
            one.card.setVisible(wanted)
            one.rule.setVisible(wanted)
            share = round(100 * self.arrangement.weight(one.lane))
            self._cards.setStretchFactor(one.card, share)
        self.refresh()

    def _places(self) -> list[tuple[LaneBox, float, float]]:
        """Visible lanes with their top and bottom, px: beside their cards."""
        cards = [(one.box, one.card.geometry()) for one in self.visible_rows()]
        return [(box, float(g.top()), float(g.top() + g.height())) for box, g in cards]

    def refresh(self) -> None:
        """Repaint what is visible."""
        self.scene.refresh()
        self.navigator.refresh()

    def show_values(self) -> None:
        """Update the numbers on the cards."""
        for one in self.visible_rows():
            one.show_numbers(self.source)

    def row(self, key: str) -> LaneRow | None:
        """The lane of that key, if the scene has it."""
        return next((one for one in self.rows if one.lane.key == key), None)

    def visible_rows(self) -> list[LaneRow]:
        """Lanes on screen, from the top."""
        return [one for one in self.rows if one.card.isVisibleTo(self)]

    def is_hidden(self, key: str) -> bool:
        """Whether the user folded this lane away."""
        return key in self.arrangement.hidden

    def show_laws(self, laws: Sequence[Trace]) -> None:
        """Draw these laws of the rate over it."""
        self.stage.laws = laws
        self.refresh()

    def show_statistics(self, found: Mapping[str, SignalStatistics]) -> None:
        """Show what the samples between the cursors come to, by signal."""
        for one in self.rows:
            one.statistics = found.get(one.lane.key)
        self.show_values()

    def _follow_picture(self) -> None:
        """What is at the right edge has moved with the picture."""
        if not self.source.running:
            self.show_values()

    def _tint(self) -> None:
        self.stage.tokens = self._theme.tokens
        for one in self.rows:
            one.tint()
        self.refresh()

    def _move_once(self, which: LaneRow, way: int) -> None:
        self.move_lane(which, way)
        self.arranged.emit()

    def _act(self, which: LaneRow, act: LaneAct) -> None:
        """Do what was asked of a lane by a key."""
        box, shown = which.box, self.visible_rows()
        if act in (LaneAct.UP, LaneAct.DOWN):
            self._move_once(which, -1 if act is LaneAct.UP else 1)
        elif act in (LaneAct.TALLER, LaneAct.SHORTER):
            self._resize(which, STEP if act is LaneAct.TALLER else -STEP)
            self.arranged.emit()
        elif act in (LaneAct.ABOVE, LaneAct.BELOW):
            at = shown.index(which) + (-1 if act is LaneAct.ABOVE else 1)
            if 0 <= at < len(shown):
                shown[at].card.setFocus()
        elif box.valued and act in (LaneAct.CLOSER, LaneAct.FURTHER):
            factor = 1.25 if act is LaneAct.CLOSER else 1 / 1.25
            box.zoom(factor, box.geometry().center().y())
        elif box.valued:
            box.move_by(0.1 if act is LaneAct.HIGHER else -0.1)
        self.refresh()

    def _ask_by_key(self, which: LaneRow) -> None:
        """The menu of a lane, at cursor A or the middle of what is seen."""
        view, box, card = self.view, which.box, which.card
        time = view.start + view.width / 2
        if view.cursors is not None and view.start <= view.cursors[0] <= view.end:
            time = view.cursors[0]
        here = QPointF(self.stage.whole().x1(time), box.geometry().center().y())
        self._ask(box, here, card.mapToGlobal(card.rect().center()))

    def _ask(self, box: LaneBox, here: QPointF, at: QPoint) -> None:
        """The menu of a lane, at a place in it."""
        time, value = self.scene.time_at(here.x()), box.value_at(here.y())
        menu, view, lane = Menu(self), self.view, box.lane
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.setAccessibleName(lane.plain)

        def lock(on: bool) -> None:
            box.choose_range(locked=on)
            self.refresh()

        def levels(new: Sequence[float] = ()) -> None:
            box.levels = [*box.levels[-1:], *new] if new else []
            self.refresh()

        locked = menu.addAction("Keep this range", lambda: lock(not box.locked))
        locked.setCheckable(True)
        locked.setChecked(box.locked)
        automatic = menu.addAction("Automatic range", lambda: lock(False))
        automatic.setEnabled(box.locked)
        menu.addAction(f"Hide {lane.name}", lambda: self.hide_lane(lane.key, True))
        place = menu.addMenu("Arrange")
        own = next(row for row in self.rows if row.lane is lane)
        for words, way in (("Move up", -1), ("Move down", 1)):
            place.addAction(words, partial(self._move_once, own, way))
        place.addAction("All as at first", self.forget_arrangement)
        menu.addSeparator()
        menu.addAction("Back to the view before", view.back)
        menu.addAction("Forward again", view.forward)
        steps = menu.addMenu("Jump to step")
        for hold in [one for one in self.source.holds if not one.pause][:STEPS]:
            span = hold.start, hold.end - hold.start
            steps.addAction(hold.label, partial(view.show_step, *span))
        steps.setEnabled(not steps.isEmpty())
        menu.addSeparator()
        for which, name in enumerate("AB"):
            put = partial(view.put_cursor, which, time)
            menu.addAction(f"Cursor {name} here", put)
        level = menu.addAction("Level line here", lambda: levels([value]))
        level.setEnabled(box.valued)
        menu.addAction("Remove level lines", levels).setEnabled(bool(box.levels))
        if lane.key == "V_K":
            near = box.level_at(here.y())
            level_ = value if near is None else box.levels[near]
            count = menu.addAction(f"Count spikes from {number(level_, 2)} V on")
            count.triggered.connect(lambda: self.threshold_asked.emit(level_))
            count.setEnabled(level_ > 0)
        cross = menu.addAction("Crosshair", self.scene.toggle_crosshair)
        cross.setCheckable(True)
        cross.setChecked(self.scene.crosshair)
        menu.addSeparator()
        menu.addAction("Copy picture", self.scene.copy)
        menu.addAction("Export this view …", self.export_asked.emit)
        menu.popup(at)
