"""One lane on screen: its card with numbers, and its plot in the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gui.lanes.box import LaneBox
from gui.lanes.card import LaneCard
from gui.lanes.compare import MARKS
from gui.lanes.expected import starts
from gui.lanes.floor import LaneContext
from gui.lanes.lane import Lane
from gui.lanes.readings import (
    count_between,
    interval_text,
    newest,
    values_at,
    view_text,
)
from gui.lanes.source import Source
from gui.look.theme import Theme
from gui.parts import line
from gui.plots.numbers import number, signed
from tactile_lab.measurement import BETWEEN_SAMPLES, CUT_OFF, TOO_FAST

if TYPE_CHECKING:
    from tactile_lab.store.statistics import SignalStatistics

ROOM = 96
"""Height of a card from which on there is room for statistics, px."""


UNRATED = {
    BETWEEN_SAMPLES: "not all are seen",
    TOO_FAST: "no count: too fast",
    CUT_OFF: "no count: cut off",
}
"""Why spikes have no rate and no intervals, in few words."""


class LaneRow:
    """One lane: its card with the line below it, and its plot in the scene.

    Attributes:
        statistics: of the samples between the cursors; None where nobody knows.
    """

    def __init__(self, lane: Lane, stage: LaneContext, theme: Theme) -> None:
        self.lane = lane
        self.card = LaneCard(lane, theme)
        self.card.setAccessibleDescription(
            f"{lane.plain} against time. Enter opens the menu of the lane."
        )
        self.rule = line()
        self.box = LaneBox(lane, stage)
        self.statistics: SignalStatistics | None = None
        self._stage, self._theme = stage, theme
        self.tint()

    def show_numbers(self, source: Source) -> None:
        """Update the card.

        It has the newest value while the run lasts; afterwards what is at the right
        edge of the view, as the tag has it, and of spikes how many are in view.
        """
        lane, card, view = self.lane, self.card, self._stage.view
        edge = source.reach if source.running else source.right_edge(view, lane)
        if len(source.members) > 1:
            self._show_runs(source, edge)
        elif lane.raster:
            self._show_spikes(source, edge)
        else:
            known = None if source.running else self._values(source, edge)[0]
            card.show_value(newest(lane, source) if source.running else known)
            why = source.why_unrated(edge, edge) if lane.key == "rate" else ""
            card.show_more(UNRATED[why] if why else self._at_cursors(source))

    def _show_spikes(self, source: Source, edge: float) -> None:
        spikes, steps, view = source.spikes, starts(source.holds), self._stage.view
        if source.running:
            why = source.why_unrated(edge, edge)
            words = interval_text(spikes, source.reach, steps)
            self.card.show_value(newest(self.lane, source))
        else:
            why = source.why_unrated(view.start, edge)
            words = view_text(spikes, view.start, edge, steps)
            seen = count_between(spikes, view.start, edge)
            self.card.show_value(float(seen), "in view")
        if why:
            words = UNRATED[why]
        if view.cursors is not None:
            words = f"{count_between(spikes, *sorted(view.cursors))} between A and B"
        self.card.show_more(words)

    def _show_runs(self, source: Source, edge: float) -> None:
        """One line per run."""
        cursors = self._stage.view.cursors
        less = f"less {MARKS[0]}" if source.subtracts(self.lane) else ""
        if self.lane.raster:
            low, high = sorted(
                cursors or (self._stage.view.start, self._stage.view.end)
            )
            counts = [float(count_between(m.spikes, low, high)) for m in source.members]
            self.card.show_runs(counts, None, "A to B" if cursors else "in view")
        elif cursors is None:
            self.card.show_runs(self._values(source, edge), None, less)
        else:
            a, b = (self._values(source, time) for time in cursors)
            changes = [_change(one, two) for one, two in zip(a, b, strict=True)]
            self.card.show_runs(a, changes, f"{less} at A".strip())

    def _at_cursors(self, source: Source) -> str:
        """Values at A and B and their difference; "" without cursors."""
        cursors, tokens = self._stage.view.cursors, self._theme.tokens
        if cursors is None:
            return ""
        a, b = (self._values(source, time)[0] for time in cursors)
        change, places = _change(a, b), min(self.lane.places, 2)
        delta = "—" if change is None else signed(change, places)
        words = [
            f'<span style="color:{colour};font-weight:600">{name}</span> '
            f"{'—' if value is None else number(value, places)}"
            for name, value, colour in (("A", a, tokens.accent), ("B", b, tokens.V_C1))
        ]
        return f"{' &nbsp;'.join(words)} &nbsp;Δ {delta}{self._between()}"

    def _between(self) -> str:
        """Least, largest, mean and rms of the samples from A to B, as two lines."""
        found, scale = self.statistics, self.lane.scale
        if found is None:
            self.card.setToolTip("")
            return ""
        values = found.low, found.high, found.mean, found.rms
        low, high, mean, rms = (number(scale * v, self.lane.places) for v in values)
        less = number(scale * found.deviation, self.lane.places + 2)
        self.card.setToolTip(
            f"Of {found.samples} samples from A to B, {self.lane.unit}: min {low}, "
            f"max {high}, mean {mean}, rms {rms}, rms about the mean {less}"
        )
        if self.card.height() < ROOM:
            return ""
        return f"<br>min {low} &nbsp;max {high}<br>mean {mean} &nbsp;rms {rms}"

    def _values(self, source: Source, time: float) -> tuple[float | None, ...]:
        return values_at(self.lane, source, time, self.box.painted)

    def tint(self) -> None:
        """Colour the swatch as theme and source want it."""
        # in a comparison colour means run, so the lane's own colour steps back
        self.card.tint(grey=len(self._stage.source.members) > 1)


def _change(a: float | None, b: float | None) -> float | None:
    return None if a is None or b is None else b - a
