"""Studies beside the runs: what each says, its figures as points come, each point."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from html import escape
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QWidget

from gui.dialogs.overlay import Overlay
from gui.look.theme import Theme
from gui.on_desktop import open_on_desktop
from gui.parts import STRETCH, Combo, column, label, push, row, say, scrolling
from gui.plots.small_plot import SmallPlot
from tactile_lab.conclusion import Table
from tactile_lab.errors import RunFolderError, TactileLabError
from tactile_lab.studies.live import SeenStudy, is_running, look_at, studies_in
from tactile_lab.studies.page import REPORT

AGAIN = 1000
"""Milliseconds after which the files are looked at anew."""
NONE = (
    "No studies yet in {0}. tactile-lab study STUDY.toml --out {0} makes one: a scene "
    "at many points, see docs/studies.md."
)


POINT = 380
"""Width of a point with two keys, px."""

HINT = "Click a point or a cell: its run opens, or its scene where none was kept."


class StudiesCard(Overlay):
    """A choice of studies; below it what the chosen one says, and its figures.

    Attributes:
        choice: of studies.
        text: what the chosen one says.
        tables: what it says beyond that.
        figures: of it.
        hint: what a click does, or why it did not.
    """

    opened = Signal(Path)
    """A point was clicked: the folder of its run, or the file of its scene."""

    def __init__(self, window: QWidget, theme: Theme) -> None:
        super().__init__(window, 760)
        self._theme = theme
        self._roots: tuple[Path, ...] = ()
        self._folders: list[Path] = []
        self._stamp: tuple[object, ...] = ()
        self._seen: SeenStudy | None = None
        self.figures: list[SmallPlot] = []
        self.choice = Combo()
        self.choice.setAccessibleName("Study")
        self.state = label("", "pill")
        self.text = label("", "", wrap=True)
        self.tables = label("", "", wrap=True)
        self.tables.setTextFormat(Qt.TextFormat.RichText)
        self.hint = label(HINT, "muted", wrap=True)
        self.page = push("Open the report")
        self.page.clicked.connect(self._open_page)
        self.close_button = push("Close", "primary")
        self.close_button.clicked.connect(self.hide)
        self.points = Combo()
        self.points.setAccessibleName("Point")
        self.points.setMaximumWidth(POINT)
        # what tells points apart stands first, why one failed last
        self.points.view().setTextElideMode(Qt.TextElideMode.ElideRight)
        self.point = push("Open the point")
        self.point.clicked.connect(lambda: self._pick(self.points.currentData()))
        inner = QWidget()
        self._rows = column(inner, self.text, self.tables, spacing=10)
        self._rows.addStretch(1)
        self._area = scrolling(inner)
        self.give_room(self._area, 430)
        head = row(label("Studies", "big"), (self.choice, 1), self.state, spacing=12)
        pick = row((self.hint, 1), self.points, self.point, spacing=12)
        foot = row(STRETCH, self.page, self.close_button, spacing=12)
        column(self.card, head, self._area, pick, foot, margin=22, spacing=14)
        self.choice.currentIndexChanged.connect(self._show_chosen)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._look_again)

    def show_studies(self, roots: tuple[Path, ...]) -> None:
        """Show the studies in these folders."""
        self._roots, self._stamp = roots, ()
        self.refresh()
        self.open()
        self._timer.start(AGAIN)
        self.close_button.setFocus()

    def refresh(self) -> None:
        """Look at the files; what has not changed stays as it is."""
        found = studies_in(*self._roots)
        if set(found) != set(self._folders):
            chosen = self._chosen
            self._folders = found
            self.choice.blockSignals(True)
            self.choice.clear()
            self.choice.addItems([path.name for path in found])
            if chosen in found:
                self.choice.setCurrentIndex(found.index(chosen))
            self.choice.blockSignals(False)
            self._stamp = ()
        self._show()

    def _look_again(self) -> None:
        """Look while somebody else does; the files are left alone after."""
        if self.isVisible():
            self.refresh()
        else:
            self._timer.stop()

    @property
    def _chosen(self) -> Path | None:
        at = self.choice.currentIndex()
        return self._folders[at] if 0 <= at < len(self._folders) else None

    def _show_chosen(self, *_: object) -> None:
        """Show another study, from its beginning."""
        self._show()
        self._area.verticalScrollBar().setValue(0)

    def _show(self) -> None:
        folder = self._chosen
        self.choice.setVisible(folder is not None)
        self.state.setVisible(folder is not None)
        if folder is None:
            say(self.text, NONE.format(self._roots[0]))
            self._draw(None)
            self.page.setEnabled(False)
            return
        try:
            stamp = (
                folder,
                is_running(folder),
                (folder / REPORT).is_file(),
                *((p, p.stat().st_mtime_ns) for p in folder.glob("*.json")),
            )
            if stamp == self._stamp:
                return
            seen = look_at(folder)
        except (RunFolderError, OSError) as error:  # between two of its files
            say(self.text, str(error))
            return
        self.state.setText("Running" if seen.running else "At rest")
        self.page.setEnabled((folder / REPORT).is_file())
        self._stamp = stamp
        say(self.text, "\n".join((seen.title, *seen.sentences)))
        self._draw(seen)

    def _draw(self, seen: SeenStudy | None) -> None:
        plots = () if seen is None else seen.plots
        self._seen = seen
        told = as_html(() if seen is None else seen.tables, self._theme.tokens.muted)
        self.tables.setText(told)
        self.tables.setVisible(bool(told))
        say(self.hint, HINT if plots else "")
        chosen = self.points.currentData()
        self.points.clear()
        for number, point in ({} if seen is None else seen.points).items():
            self.points.addItem(str(point), number)
            last = self.points.count() - 1
            self.points.setItemData(last, str(point), Qt.ItemDataRole.ToolTipRole)
        self.points.setCurrentIndex(max(0, self.points.findData(chosen)))
        for one in (self.points, self.point):
            one.setVisible(self.points.count() > 0)
        while len(self.figures) < len(plots):
            figure = SmallPlot(self._theme)
            figure.picked.connect(self._pick)
            figure.tell = self._told
            self.figures.append(figure)
            self._rows.insertWidget(len(self.figures), figure)
        for figure, plot in zip(self.figures, plots, strict=False):
            figure.show_plot(plot)
            figure.setMaximumHeight(figure.minimumHeight())
        for number, figure in enumerate(self.figures):
            figure.setVisible(number < len(plots))

    def _told(self, number: int) -> str:
        point = None if self._seen is None else self._seen.points.get(number)
        return "" if point is None else str(point)

    def _pick(self, number: int) -> None:
        """Open a point's run, or its scene where no run was kept."""
        if self._seen is None or number not in self._seen.points:
            return
        try:
            found = self._seen.run_of(number) or self._seen.scene_of(number)
        except (TactileLabError, OSError) as error:
            say(self.hint, str(error))
            return
        self.hide()
        self.opened.emit(found)

    def _open_page(self) -> None:
        if self._chosen is not None:
            say(self.hint, open_on_desktop(self._chosen / REPORT))


def as_html(tables: Iterable[Table], muted: str) -> str:
    """Tables under their titles as rich text; headings and notes have a colour."""
    found = []
    for table in tables:
        head, *rows = (_html_row(cells) for cells in (table.headings, *table.rows))
        found += [
            f"<p><b>{escape(table.title, quote=False)}</b></p>" if table.title else ""
        ]
        found += [f'<table cellspacing="0"><tr style="color:{muted}">{head}</tr>']
        found += [f"<tr>{cells}</tr>" for cells in rows]
        found += [
            f'</table><p style="color:{muted}">{escape(table.note, quote=False)}</p>'
        ]
    return "".join(found)


def _html_row(cells: Sequence[str]) -> str:
    """Cells of a row: the first and the last stand left, the rest right."""
    sides = ["right"] * len(cells)
    sides[0] = sides[-1] = "left"
    return "".join(
        f'<td align="{side}" style="padding:3px 18px 3px 0">'
        f"{escape(cell.replace('Ohm', 'Ω'), quote=False)}</td>"
        for side, cell in zip(sides, cells, strict=True)
    )


def show_studies(
    window: QWidget,
    theme: Theme,
    roots: tuple[Path, ...],
    opened: Callable[[Path], object],
) -> None:
    """Show the card over the window; `opened` is told what a click asks for."""
    card = window.findChild(StudiesCard)
    if not isinstance(card, StudiesCard):
        card = StudiesCard(window, theme)
        card.opened.connect(opened)
    card.show_studies(roots)
