"""What lanes paint: on the screen, into files, and where painting fails."""

import re
from pathlib import Path

import numpy as np
import pytest
from lane_stack import box, settle
from PySide6.QtCore import QPoint, QRectF, qInstallMessageHandler
from PySide6.QtGui import QImage, QPainter
from PySide6.QtSvg import QSvgGenerator, QSvgRenderer

from gui.lanes.live import LiveSource
from gui.look.tokens import DARK, LIGHT


@pytest.mark.parametrize("tokens", [LIGHT, DARK], ids=["light", "dark"])
def test_the_same_picture_on_screen_in_png_and_in_svg(app, stack, tokens, tmp_path):
    stack.stage.tokens = tokens
    target = QRectF(stack.scene.rect())
    size = stack.scene.size()
    pictures = {"screen": stack.scene.grab().toImage()}
    pictures["png"] = QImage(size, QImage.Format.Format_RGB32)
    painter = QPainter(pictures["png"])
    stack.scene.draw_onto(painter, target, tokens)
    painter.end()
    draw_svg(stack, tmp_path / "lanes.svg")
    pictures["svg"] = QImage(size, QImage.Format.Format_RGB32)
    painter = QPainter(pictures["svg"])
    QSvgRenderer(str(tmp_path / "lanes.svg")).render(painter, target)
    painter.end()
    grey = {name: pixels(image) for name, image in pictures.items()}
    assert np.array_equal(grey["screen"], grey["png"])
    assert np.mean(np.abs(grey["svg"] - grey["screen"]) > 40) < 0.02
    assert grey["screen"].std() > 3


def draw_svg(stack, file: Path) -> None:
    generator, target = QSvgGenerator(), QRectF(stack.scene.rect())
    generator.setFileName(str(file))
    generator.setSize(stack.scene.size())
    generator.setViewBox(target)
    painter = QPainter(generator)
    stack.scene.draw_onto(painter, target, stack.stage.tokens)
    painter.end()


def pixels(image: QImage) -> np.ndarray:
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    rows = np.frombuffer(grey.constBits(), np.uint8).reshape(grey.height(), -1)
    return rows[:, : grey.width()].astype(int)


def test_lanes_that_cannot_be_painted_leave_the_window_alive(app, stack, qtbot):
    lane, complaints = box(stack, "V_C1"), []
    before = qInstallMessageHandler(lambda *words: complaints.append(words[-1]))
    with qtbot.captureExceptions() as told:
        for one in (lane, box(stack, "V_K")):
            one._traces = lambda *_: 1 / 0
        stack.scene.grab()
        stack.scene.grab()
        for one in (lane, box(stack, "V_K")):
            del one._traces
        settle(app)
    qInstallMessageHandler(before)
    assert complaints == [], "Painter ended with 2 saved states"
    assert len(told) >= 4 and {one[0] for one in told} == {ZeroDivisionError}
    assert not stack.scene.grab().isNull()


def test_a_stretch_beyond_the_range_is_shaded(app, stack, monkeypatch):
    bare = stack.scene.grab().toImage()
    beyond = {"V_C1": np.array([[7.0, 9.0]])}
    nothing = np.empty((0, 2))
    monkeypatch.setattr(
        LiveSource, "beyond", lambda self, signal: beyond.get(signal, nothing)
    )
    seen = stack.scene.grab().toImage()
    for key, marked in (("V_C1", True), ("V_K", False)):
        lane = box(stack, key)
        at = QPoint(round(stack.stage.whole().x1(8.0)), round(lane.y() + 4))
        assert (seen.pixelColor(at) != bare.pixelColor(at)) is marked, key


@pytest.mark.parametrize(("width", "whole"), [(900, True), (460, False)])
def test_why_there_is_no_rate_ends_with_the_lane(
    app, stack, tmp_path, width: int, whole: bool
) -> None:
    """It ended in the middle of a word at the lane's right edge."""
    source = stack.source
    source.shortest_interval = 2.0
    source.add_spikes(tuple(20.0 + at for at in range(5)))
    assert source.unrated
    stack.resize(width, 600)
    stack.view.show_span(10.0, 10.0)
    settle(app)
    draw_svg(stack, tmp_path / "lanes.svg")
    written = re.findall(r">([^<>]*)</text>", (tmp_path / "lanes.svg").read_text())
    (said,) = (text for text in written if text.startswith("no rate"))
    assert said.endswith("can fire" if whole else "…")
