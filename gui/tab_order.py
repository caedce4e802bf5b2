"""The order in which Tab goes through the window: as one reads it.

Qt goes by when a widget was made; forms, cards and rows are made anew all the time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cmp_to_key

from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSlider,
    QApplication,
    QScrollArea,
    QWidget,
)


def in_reading_order(root: QWidget) -> list[QWidget]:
    """What can take the keyboard inside `root`: row by row, each from left to right."""
    inside = [
        child
        for child in root.children()
        if isinstance(child, QWidget) and child.isVisible() and not child.isWindow()
    ]
    found = []
    for child in sorted(inside, key=cmp_to_key(_compared)):
        if _takes_keyboard(child):
            found.append(child)
        found += in_reading_order(child)
    return found


def move_on(roots: Iterable[QWidget], rest: QWidget, *, forward: bool) -> bool:
    """Give the keyboard to the next widget in `roots`, or the one before it.

    Qt asks for that also where what has the keyboard is locked or hidden: then `rest`,
    which is no button, gets it, for Space shall not press what comes next.
    """
    order = [widget for root in roots for widget in in_reading_order(root)]
    now = QApplication.focusWidget()
    if now is not None and not (now.isEnabled() and now.isVisible()):
        rest.setFocus()
    elif now in order:
        at = order.index(now) + (1 if forward else -1)
        reach(order[at % len(order)], forward=forward)
    elif order:
        reach(order[0 if forward else -1], forward=forward)
    return bool(order)


def enter_next(panels: Sequence[QWidget], *, forward: bool) -> None:
    """Give the keyboard to the first widget of the panel after that which has it."""
    found = [(panel, in_reading_order(panel)) for panel in panels if panel.isVisible()]
    orders = [(panel, order) for panel, order in found if order]
    now = QApplication.focusWidget()
    inside = [
        n for n, (panel, _) in enumerate(orders) if now and panel.isAncestorOf(now)
    ]
    if orders:
        at = inside[0] + (1 if forward else -1) if inside else 0 if forward else -1
        reach(orders[at % len(orders)][1][0])


def scroll(root: QWidget, way: int) -> None:
    """Scroll what is seen of `root` by a page: up (-1) or down (1)."""
    for area in root.findChildren(QScrollArea):
        bar = area.verticalScrollBar()
        if area.isVisible() and bar.maximum() > 0:
            bar.setValue(bar.value() + way * bar.pageStep())
            take_along(area, way)
            return


def take_along(area: QScrollArea, way: int) -> None:
    """Have the keyboard go on to what is in sight, where its place was scrolled away.

    What acts at a key it does not go to: no button, and no slider.

    Args:
        area: what was scrolled.
        way: below zero where that was up.
    """
    inner, now = area.widget(), QApplication.focusWidget()
    if inner is None or now is None or not inner.isAncestorOf(now):
        return
    height = area.viewport().height()

    def top(one: QWidget) -> int:
        return one.mapTo(area.viewport(), QPoint()).y()

    if 0 <= top(now) <= height - now.height():
        return
    order = [one for one in in_reading_order(inner) if not _acts(one)]
    ahead = [one for one in order if top(one) >= 0]
    if way < 0:
        order.reverse()
        ahead = [one for one in order if top(one) <= height - one.height()]
    for one in (*ahead, *order[-1:])[:1]:
        reach(one, forward=way > 0)


def _acts(one: QWidget) -> bool:
    presses = isinstance(one, QAbstractButton) and not one.isCheckable()
    return presses or isinstance(one, QAbstractSlider)


def _takes_keyboard(widget: QWidget) -> bool:
    by_tab = bool(widget.focusPolicy() & Qt.FocusPolicy.TabFocus)
    return by_tab and widget.isEnabled() and widget.focusProxy() is None


def _compared(one: QWidget, other: QWidget) -> int:
    """Below zero where `one` is read before `other`."""
    a, b = one.geometry(), other.geometry()
    shared = min(a.bottom(), b.bottom()) - max(a.top(), b.top())
    if shared > min(a.height(), b.height()) / 2:  # they stand in one row
        return a.left() - b.left()
    return a.top() - b.top()


def reach(widget: QWidget, *, forward: bool = True) -> None:
    """Give a widget the keyboard, and scroll to it."""
    tab, back = Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason
    widget.setFocus(tab if forward else back)
    area = widget.parentWidget()
    while area is not None:
        if isinstance(area, QScrollArea):
            bring_into_sight(widget, area)
        area = area.parentWidget()


def bring_into_sight(widget: QWidget, area: QScrollArea) -> None:
    """Scroll to all of a widget, its ring too: Qt does to where one types in it."""
    inner = area.widget()
    if inner is not None:
        place = widget.mapTo(inner, widget.rect().center())
        area.ensureVisible(place.x(), place.y(), 0, widget.height() // 2 + 8)
