"""Whoever works by keyboard sees where the keyboard is."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QMenu, QWidget

LEAST = 3.0
"""Contrast of what a focus ring changes (WCAG 2.2, 1.4.11 and 2.4.13)."""


def reachable(window: QWidget) -> list[QWidget]:
    """What Tab stops at, in its order."""
    found, at = [], window.nextInFocusChain()
    while at is not window:
        tabbed = at.focusPolicy() & Qt.FocusPolicy.TabFocus
        tabbed = (
            tabbed and at.focusProxy() is None
        )  # the line in a choice is its inside
        if tabbed and at.isVisible() and at.isEnabled() and at.window() is window:
            found.append(at)
        at = at.nextInFocusChain()
    return found


def pixels(widget: QWidget) -> np.ndarray:
    """Shape (height, width, 3): red, green, blue, 0 to 1."""
    image = widget.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    rows = np.frombuffer(image.constBits(), np.uint8)
    rows = rows.reshape(image.height(), image.bytesPerLine() // 4, 4)
    return rows[:, : image.width(), 2::-1] / 255


def luminance(colours: np.ndarray) -> np.ndarray:
    """Relative luminance (WCAG 2)."""
    linear = np.where(
        colours <= 0.03928, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4
    )
    return linear @ np.array([0.2126, 0.7152, 0.0722])


def ring(lab, widget: QWidget) -> tuple[int, float]:
    """How many pixels focus changes, and the contrast that most of them gain."""
    lab.window.page.setFocus()  # acts at once; nothing else need be painted
    before = pixels(widget)
    widget.setFocus(Qt.FocusReason.TabFocusReason)
    after = pixels(widget)
    changed = np.any(before != after, axis=2)
    if not changed.any():
        return 0, 1.0
    one, other = luminance(before[changed]), luminance(after[changed])
    brighter, darker = np.maximum(one, other), np.minimum(one, other)
    contrast = (brighter + 0.05) / (darker + 0.05)
    return int(changed.sum()), float(np.percentile(contrast, 70))


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_focus_is_seen_on_every_control(lab, theme: str) -> None:
    window = lab.window
    window.theme.choose(theme)
    try:
        faint = []
        for tab in range(3):
            window.review.show_tab(tab)
            lab.app.processEvents()
            for widget in reachable(window):
                if tab and not window.review.isAncestorOf(widget):
                    continue
                count, contrast = ring(lab, widget)
                width, height = widget.width(), widget.height()
                if count < 2 * (width + height) or contrast < LEAST:
                    name = widget.accessibleName() or type(widget).__name__
                    faint.append((name, width, height, count, round(contrast, 1)))
        assert not faint
    finally:
        window.theme.choose("light")
        window.review.show_tab(0)


def test_the_next_test_has_the_window_whatever_was_open_as_it_was_asked_for(
    lab,
) -> None:
    """A focus beside a popup is the window's and does not make it active."""
    aside = QWidget()
    aside.show()
    lab.until(aside.isActiveWindow)
    popup = QMenu(aside)
    popup.addAction("Over the window")
    popup.popup(QPoint(0, 0))
    lab.until(popup.isVisible)
    lab.window.activateWindow()
    front = lab.window.windowHandle()
    lab.until(lambda: lab.app.focusWindow() is front)
    popup.close()
    assert not lab.window.isActiveWindow(), "Qt asks no more"
    lab.ready()
    assert lab.window.isActiveWindow()
