"""Small parts every panel uses: labels, buttons, panels, lines."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TypeVar

from PySide6.QtCore import QPoint, QRectF, QSize, Qt
from PySide6.QtGui import (
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QPen,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import (
    QApplication,
    QBoxLayout,
    QButtonGroup,
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLayout,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from gui.look.icons import icon, pixmap
from gui.look.theme import Theme
from gui.look.tokens import DARK
from gui.state import unmarked
from gui.tab_order import bring_into_sight, take_along


def label(text: str, role: str = "", *, wrap: bool = False) -> QLabel:
    """A label in one of the style sheet's roles."""
    made = QLabel(text)
    if role:
        made.setProperty("role", role)
    made.setWordWrap(wrap)
    return made


def set_role(widget: QWidget, role: str) -> None:
    """Give the widget another role and have it restyled."""
    if widget.property("role") != role:
        widget.setProperty("role", role)
        widget.style().unpolish(widget)
        widget.style().polish(widget)


def sign(name: str, colour: str, words: str) -> QLabel:
    """An icon that says what a row of a list is; `words` are its accessible name."""
    made = QLabel()
    made.setPixmap(pixmap(name, colour, 18))
    made.setAccessibleName(words)
    return made


def line() -> QFrame:
    """A hairline across."""
    made = QFrame()
    made.setProperty("role", "line")
    return made


def panel(role: str = "panel") -> QFrame:
    """A framed surface."""
    made = QFrame()
    made.setProperty("role", role)
    return made


class Primary(QPushButton):
    """A filled button; a border alone would not show on it where the keyboard is."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the button, and a ring inside it while it has the focus."""
        super().paintEvent(event)
        if self.hasFocus():
            painter = QPainter(self)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(QPen(self.palette().color(QPalette.ColorRole.ButtonText), 2))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(4, 4, -4, -4), 3, 3)


def push(text: str, role: str = "", *, name: str = "", tip: str = "") -> QPushButton:
    """A push button with an accessible name and a tool tip."""
    made = Primary(text) if role == "primary" else QPushButton(text)
    if role:
        made.setProperty("role", role)
    made.setAccessibleName(name or text)
    made.setToolTip(tip)
    made.setMinimumHeight(32)
    return made


class IconButton(QToolButton):
    """A tool button whose icon follows the theme.

    Args:
        theme: where colours come from.
        name: of the icon.
        words: accessible name and tool tip; the text beside the icon where `text`.
        role: of the style sheet.
        text: shown beside the icon, "" for none.
        checkable: whether it stays down.
    """

    def __init__(
        self,
        theme: Theme,
        name: str,
        words: str,
        *,
        role: str = "flat",
        text: str = "",
        checkable: bool = False,
        on_header: bool = False,
    ) -> None:
        super().__init__()
        self._theme, self._icon, self._on_header = theme, name, on_header
        self.setProperty("role", role)
        self.setCheckable(checkable)
        self.setAccessibleName(words)
        self.setToolTip(words)
        self.setIconSize(QSize(18, 18))
        self.setMinimumSize(QSize(30, 30))
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._text = text
        self.set_wide(bool(text))
        theme.changed.connect(self._tint)
        self._tint()

    def set_wide(self, wide: bool) -> None:
        """Show the text beside the icon, or the icon alone."""
        alone = not (wide and self._text)
        if alone is not self.property("alone"):
            self.setProperty("alone", alone)
            self.style().unpolish(self)
            self.style().polish(self)
        if wide and self._text:
            self.setText(self._text)
            self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        else:
            self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonIconOnly)

    def set_icon(self, name: str) -> None:
        """Show another icon."""
        self._icon = name
        self._tint()

    def _tint(self) -> None:
        tokens = self._theme.tokens
        colour = tokens.header_muted if self._on_header else tokens.muted
        down = DARK.selected_text if self._on_header else tokens.selected_text
        self.setIcon(icon(self._icon, colour, down))


class Combo(QComboBox):
    """A list that drops down; wheel and pages scroll what it stands in, not its value.

    Nor does the wheel bring it the keyboard: the next letter would choose.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel to the page."""
        event.ignore()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave page up and down to the page, too."""
        if event.key() in (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown):
            event.ignore()
        else:
            super().keyPressEvent(event)


class Segments(QFrame):
    """A row of exclusive choices; `group.idClicked` tells which."""

    def __init__(self, choices: list[str], name: str) -> None:
        super().__init__()
        self.setProperty("role", "segments")
        self.setAccessibleName(name)
        row = bar(self, (2, 2, 2, 2), 1)
        self.group = QButtonGroup(self)
        for number, choice in enumerate(choices):
            button = QToolButton()
            button.setText(choice)
            button.setCheckable(True)
            button.setProperty("role", "segment")
            button.setAccessibleName(f"{name}: {choice}")
            button.setMinimumHeight(28)
            self.group.addButton(button, number)
            row.addWidget(button)
        self.group.buttonToggled.connect(self._set_tab_stop)

    def _set_tab_stop(self) -> None:
        """Have Tab come to the choice that is made: Qt does once one had the focus."""
        none = self.chosen < 0
        for button in self.group.buttons():
            comes = none or button.isChecked()
            stop = Qt.FocusPolicy.TabFocus if comes else Qt.FocusPolicy.NoFocus
            button.setFocusPolicy(stop)

    def choose(self, number: int) -> None:
        """Check one choice (-1: none) without telling anybody."""
        if number < 0:
            checked = self.group.checkedButton()
            if checked is not None:
                self.group.setExclusive(False)
                checked.setChecked(False)
                self.group.setExclusive(True)
            return
        self.group.button(number).setChecked(True)

    @property
    def chosen(self) -> int:
        """Number of the checked choice, -1 for none."""
        return self.group.checkedId()


class _Page(QScrollArea):
    """Has what has the keyboard in sight, too, after it has become lower."""

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Scroll to it, unless somebody has scrolled it away."""
        super().resizeEvent(event)
        has, inner = QApplication.focusWidget(), self.widget()
        if has is not None and inner is not None and inner.isAncestorOf(has):
            top = has.mapTo(self.viewport(), QPoint()).y()
            if 0 <= top < event.oldSize().height():
                bring_into_sight(has, self)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take the keyboard along; leave to others what would scroll nothing here."""
        bar = self.verticalScrollBar()
        sideways = event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right)
        if sideways or not bar.maximum():
            event.ignore()
            return
        before = bar.value()
        super().keyPressEvent(event)
        if way := bar.value() - before:
            take_along(self, way)


def scrolling(inner: QWidget) -> QScrollArea:
    """`inner` in a frameless area that scrolls up and down."""
    area = _Page()
    area.setWidget(inner)
    area.setWidgetResizable(True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    return area


SCROLL_BAR = 10
"""Width of a scroll bar, px, as the style sheet has it."""


def with_gutter(area: QScrollArea, inside: QLayout) -> QScrollArea:
    """Keep `inside` as wide with a scroll bar as without: the bar has its own room."""

    def make_room(least: int, most: int) -> None:
        inside.setContentsMargins(0, 0, 0 if most > least else SCROLL_BAR, 0)

    make_room(0, 0)
    # what has grown is painted before the area knows: squeezed into what it had
    inside.setSizeConstraint(QLayout.SizeConstraint.SetMinimumSize)
    area.verticalScrollBar().rangeChanged.connect(make_room)
    return area


def stack(
    parent: QWidget,
    parts: Sequence[QWidget | QLayout],
    page: QWidget,
    *,
    spacing: int = 8,
) -> QGridLayout:
    """Parts below each other; `page`, one of them, takes the height that is left.

    The page reaches `SCROLL_BAR` further to the right than the others: its scroll bar
    lies in what is their margin.
    """
    grid = QGridLayout(parent)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setHorizontalSpacing(0)
    grid.setVerticalSpacing(spacing)
    for at, part in enumerate(parts):
        if isinstance(part, QLayout):
            grid.addLayout(part, at, 0)
        else:
            grid.addWidget(part, at, 0, 1, 2 if part is page else 1)
        grid.setRowStretch(at, int(part is page))
    grid.setColumnStretch(0, 1)
    grid.setColumnMinimumWidth(1, SCROLL_BAR)
    return grid


STRETCH = "stretch"
"""A part of a row or column that takes the room that is left."""

Box = TypeVar("Box", bound=QBoxLayout)
Part = QWidget | QLayout | tuple[QWidget | QLayout | str, int] | int | str


def filled(box: Box, parts: Sequence[Part]) -> Box:
    """Put parts into a row or column.

    Args:
        box: the layout.
        parts: widgets and layouts, alone or with their share of the room that is left;
            an empty space, px; `STRETCH`.
    """
    for part in parts:
        what, share = part if isinstance(part, tuple) else (part, 0)
        if isinstance(what, QWidget):
            box.addWidget(what, share)
        elif isinstance(what, QLayout):
            box.addLayout(what, share)
        elif isinstance(what, int):
            box.addSpacing(what)
        else:
            box.addStretch(share if isinstance(part, tuple) else 1)
    return box


def column(
    parent: QWidget, *parts: Part, margin: int = 0, spacing: int = 6
) -> QVBoxLayout:
    """A vertical layout on `parent`."""
    layout = QVBoxLayout(parent)
    layout.setContentsMargins(margin, margin, margin, margin)
    layout.setSpacing(spacing)
    return filled(layout, parts)


def lines(*parts: Part, spacing: int = -1) -> QVBoxLayout:
    """Parts below each other within another layout; `spacing`: its own, by itself."""
    layout = QVBoxLayout()
    layout.setSpacing(spacing)
    return filled(layout, parts)


def row(*parts: Part, spacing: int = -1) -> QHBoxLayout:
    """Parts beside each other; `spacing`: of the layout it stands in, by itself."""
    layout = QHBoxLayout()
    layout.setSpacing(spacing)
    return filled(layout, parts)


def bar(
    parent: QWidget, margins: tuple[int, int, int, int], spacing: int, *parts: Part
) -> QHBoxLayout:
    """Parts beside each other as all of `parent`; margins from the left clockwise."""
    layout = QHBoxLayout(parent)
    layout.setContentsMargins(*margins)
    layout.setSpacing(spacing)
    return filled(layout, parts)


def line_edit(name: str, hint: str = "", text: str = "") -> QLineEdit:
    """A field for one line of text; `hint` is shown while it is empty."""
    made = QLineEdit(text)
    made.setAccessibleName(name)
    made.setPlaceholderText(hint)
    return made


def say(where: QLabel, text: str) -> None:
    """Show a text; hide the label where there is none."""
    where.setText(unmarked(text))
    where.setVisible(bool(text))


class Elided(QLabel):
    """A label that shortens its text with an ellipsis to the room it has."""

    def __init__(self, text: str, role: str = "") -> None:
        super().__init__()
        if role:
            self.setProperty("role", role)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.set_whole(text)

    def set_whole(self, text: str, end: str = "") -> None:
        """Show `text`, as far as it fits.

        Args:
            text: on one line.
            end: the end of it that tells most: what is left where not all of it fits.
        """
        self.whole, self._end = text, end
        self.setAccessibleName(text)
        self._shorten()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Shorten anew."""
        super().resizeEvent(event)
        self._shorten()

    def _shorten(self) -> None:
        metrics, room = self.fontMetrics(), self.contentsRect().width()
        left, right = Qt.TextElideMode.ElideLeft, Qt.TextElideMode.ElideRight
        if self._end and metrics.horizontalAdvance(self.whole) > room:
            self.setText(metrics.elidedText(self._end, left, room))
        else:
            self.setText(metrics.elidedText(self.whole, right, room))


def empty(layout: QLayout, kept: Collection[QWidget] = ()) -> None:
    """Take everything out of a layout and delete it, but for what is `kept`."""
    while (item := layout.takeAt(0)) is not None:
        widget = item.widget()
        if widget is not None and widget not in kept:
            widget.hide()  # a layout shows its new widgets later, wherever they are
            widget.setParent(None)
            widget.deleteLater()
