"""Contrast as WCAG 2 counts it, of every pair of colours, and as pixels show it."""

import re
from itertools import combinations

import numpy as np
import pytest
from PySide6.QtCore import QRect
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QAbstractButton, QLabel, QWidget

from gui.header.chip import LAMPS
from gui.header.stop import StopButton
from gui.lanes.compare import MARKS
from gui.look.style import sheet
from gui.look.tokens import DARK, LIGHT, Tokens
from gui.state import CoilView, WindowState

TEXT, DRAWN, DISABLED = 4.5, 3.0, 2.0
"""Least contrast of text and of what is drawn (WCAG 2.1, 1.4.3 and 1.4.11), and of the
text of what is disabled, for which it asks nothing."""

APART = 10.0
"""Least distance of two trace colours, CIE 1976; about 2 can just be seen."""

GROUNDS = ("page", "panel", "sunken", "field", "plot", "band", "ahead", "selected")
"""What text and traces lie on."""

TRACES = ("force", "V_C1", "V_C2", "V_K", "rate")
OTHERS = ("current", "twin", "residual", "spikes", "run_a", "run_b", "run_c")

# Machado, Oliveira and Fernandes 2009, at full strength, for linear RGB
BLIND = {
    "protan": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deutan": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritan": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
    "none": np.eye(3).tolist(),
}
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)

both = pytest.mark.parametrize("tokens", [LIGHT, DARK], ids=["light", "dark"])


def linear(rgb: np.ndarray) -> np.ndarray:
    """Linear light of sRGB, both 0 to 1."""
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def rgb(colour: str) -> np.ndarray:
    """Linear RGB of "#rrggbb"."""
    return linear(np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]))


def contrast(one: str, other: str) -> float:
    """Contrast ratio of two colours, 1 to 21."""
    low, high = sorted(float(XYZ[1] @ rgb(colour)) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def lab(colour: np.ndarray) -> np.ndarray:
    """CIELAB of linear RGB, under D65."""
    t = XYZ @ np.clip(colour, 0, 1) / [0.95047, 1.0, 1.08883]
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@both
def test_text_can_be_read_wherever_it_stands(tokens: Tokens) -> None:
    for name in ("text", "muted"):
        for ground in GROUNDS:
            ratio = contrast(getattr(tokens, name), getattr(tokens, ground))
            assert ratio >= TEXT, (name, ground, round(ratio, 2))
    for name in ("red", "amber", "green", "accent", "selected_text"):
        for ground in ("panel", "sunken", "plot"):
            ratio = contrast(getattr(tokens, name), getattr(tokens, ground))
            assert ratio >= TEXT, (name, ground, round(ratio, 2))


@both
def test_every_colour_of_text_of_the_style_sheet_can_be_read(tokens: Tokens) -> None:
    """Rules that say no ground stand on a panel, those of the header on the header."""
    faint = []
    for rule, body in re.findall(r"([^{}]+)\{([^{}]*)\}", sheet(tokens)):
        said = dict(re.findall(r"(?:^|[\s;])(color|background): (#\w{6})", body))
        if "color" not in said:
            continue
        name = rule.strip()
        header = re.search(r'role="h\w', name) is not None
        grounds = ["header", "header_chip"] if header else ["panel", "sunken"]
        own = said.get("background")
        for ground in [own] if own else [getattr(tokens, one) for one in grounds]:
            ratio = contrast(said["color"], ground)
            if ratio < (DISABLED if ":disabled" in name else TEXT):
                faint.append((name, said["color"], ground, round(ratio, 2)))
    assert not faint


@both
def test_what_is_disabled_is_told_apart(tokens: Tokens) -> None:
    for ground in ("panel", "sunken", "selected"):
        ratio = contrast(tokens.faint, getattr(tokens, ground))
        assert DISABLED <= ratio, (ground, round(ratio, 2))
    assert contrast(tokens.faint, tokens.text) >= DRAWN


@both
def test_the_edge_of_every_control_stands_out(tokens: Tokens) -> None:
    """WCAG 2.1, 1.4.11; borders as the style sheet has them."""
    for ground in ("page", "panel", "sunken", "field"):
        ratio = contrast(tokens.control, getattr(tokens, ground))
        assert ratio >= DRAWN, (ground, round(ratio, 2))
    text = sheet(tokens)
    for one in ("QLineEdit, QComboBox", "QPushButton, QToolButton"):
        body = re.search(rf"\n{re.escape(one)}[^{{}}]*\{{([^}}]*)\}}", text)
        assert body is not None and f"border: 1px solid {tokens.control}" in body[1]


@both
def test_all_that_is_plotted_stands_out(tokens: Tokens) -> None:
    for name in (*TRACES, *OTHERS):
        for ground in ("plot", "panel", "sunken", "band", "ahead"):
            ratio = contrast(getattr(tokens, name), getattr(tokens, ground))
            assert ratio >= DRAWN, (name, ground, round(ratio, 2))
        tag = contrast(getattr(tokens, name), tokens.on_accent)  # its value, on it
        assert tag >= TEXT, (name, round(tag, 2))


@pytest.mark.parametrize("sight", BLIND)
@both
def test_traces_are_told_apart_by_the_colour_blind(tokens: Tokens, sight: str) -> None:
    for among in (TRACES, ("run_a", "run_b", "run_c")):
        seen = {n: lab(np.array(BLIND[sight]) @ rgb(getattr(tokens, n))) for n in among}
        for one, other in combinations(among, 2):
            far = float(np.linalg.norm(seen[one] - seen[other]))
            assert far >= APART, (one, other, round(far, 1))


def test_lamps_and_words_of_the_header_can_be_seen() -> None:
    for lamp, (_, colour, _) in LAMPS.items():
        for ground in (LIGHT.header, LIGHT.header_chip, DARK.header, DARK.header_chip):
            assert contrast(colour, ground) >= DRAWN, lamp


# --- as it is drawn


def seen(window: QWidget) -> np.ndarray:
    """Luminances of a window as it is on screen, shape (height, width)."""
    image = window.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    row = image.bytesPerLine() // 4
    raw = np.frombuffer(image.constBits(), np.uint32).reshape(image.height(), row)
    raw = raw[:, : image.width()]
    light = linear(np.arange(256) / 255)
    return sum(
        share * light[raw >> shift & 255]
        for share, shift in zip(XYZ[1], (16, 8, 0), strict=True)
    )


def drawn_contrast(picture: np.ndarray, widget: QWidget, where: QRect) -> float:
    """Contrast of the ink in a part of a widget and what most of it is filled with."""
    at = widget.mapTo(widget.window(), where.topLeft())
    found = picture[at.y() : at.y() + where.height(), at.x() : at.x() + where.width()]
    values, counts = np.unique(found.round(4), return_counts=True)
    ground = values[counts.argmax()]
    low, high = np.minimum(found, ground), np.maximum(found, ground)
    return float(((high + 0.05) / (low + 0.05)).max())


STATES = {
    "no source": (WindowState.DISCONNECTED, None),
    "off": (WindowState.READY, CoilView(False, 0.0, 0.0, verified_off=True)),
    "off in a fault": (WindowState.FAULT, CoilView(False, 0.0, 0.0, verified_off=True)),
    "live": (WindowState.RUNNING, CoilView(True, 0.374, 0.374, limit=2.0)),
    "falling": (WindowState.ABORTING, CoilView(True, 0.374, 0.374, limit=2.0)),
    "unknown": (WindowState.FAULT, CoilView(False, None, verified_off=False)),
}


@pytest.mark.parametrize("down", [False, True], ids=["up", "down"])
@pytest.mark.parametrize("state", STATES)
def test_stop_can_be_read_in_every_state(app, state: str, down: bool) -> None:
    stop = StopButton()
    stop.show_coil(*STATES[state])
    stop.setDown(down)
    picture = seen(stop)
    for top in (10, 28):  # its two lines
        assert drawn_contrast(picture, stop, QRect(54, top, 120, 16)) >= TEXT
    stop.deleteLater()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_all_words_on_screen_can_be_read(lab, theme: str) -> None:
    window, faint = lab.window, []
    window.theme.choose(theme)
    try:
        for tab in range(4):
            window.review.show_tab(tab)
            lab.app.processEvents()
            picture = seen(window)
            root = window if tab == 0 else window.review
            for one in root.findChildren(QWidget):
                text = isinstance(one, (QLabel, QAbstractButton)) and one.text()
                if not text or not one.visibleRegion().contains(one.rect()):
                    continue
                if isinstance(one, StopButton) or one.property("alone"):
                    continue  # above; an icon without its words
                ratio = drawn_contrast(picture, one, one.rect())
                words = DRAWN if text in MARKS else TEXT  # a test before may compare
                if ratio < (words if one.isEnabled() else DISABLED):
                    faint.append((type(one).__name__, one.text(), round(ratio, 2)))
        assert not faint
    finally:
        window.theme.choose("light")
        window.review.show_tab(0)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_what_an_empty_field_means_can_be_read(lab, theme: str) -> None:
    lab.window.theme.choose(theme)
    try:
        lab.window.page.setFocus()
        note = lab.window.centre.log.note
        assert note.placeholderText() and not note.text()
        assert (
            drawn_contrast(seen(lab.window), note, note.rect().adjusted(6, 6, -6, -6))
            >= TEXT
        )
    finally:
        lab.window.theme.choose("light")
