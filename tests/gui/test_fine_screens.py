"""Traces on screens that are scaled: Qt strokes wider lines tens of times slower."""

import numpy as np
import pytest
from PySide6.QtGui import QColor, QImage, QPainter

from gui.lanes import paint
from gui.lanes.paint import Frame
from tactile_lab.trace import Trace

WIDE, HIGH = 100, 40


def onto(ratio: float) -> tuple[QImage, QPainter]:
    size = round(WIDE * ratio), round(HIGH * ratio)
    image = QImage(*size, QImage.Format.Format_ARGB32_Premultiplied)
    image.setDevicePixelRatio(ratio)
    image.fill(0)
    return image, QPainter(image)


def frame() -> Frame:
    return Frame(0.0, WIDE, 0.0, HIGH, 0.0, float(WIDE), -2.0, 2.0)


def noise() -> Trace:
    time = np.arange(float(WIDE)) + 0.5
    return Trace.bins(time, -1 - 0.01 * time, 1 - 0.01 * time, 0 * time, 1.0)


def lit(image: QImage) -> np.ndarray:
    row = image.bytesPerLine() // 4
    pixels = np.frombuffer(image.constBits(), np.uint32).reshape(image.height(), row)
    return (pixels[:, : image.width()] >> 24).astype(int)


@pytest.mark.parametrize("ratio", [1, 1.25, 1.5, 2, 3])
@pytest.mark.parametrize("draw", ["trace", "envelope"])
def test_no_stroke_is_wider_than_a_device_pixel(app, ratio: float, draw: str):
    image, painter = onto(ratio)
    if draw == "trace":
        paint.trace(painter, frame(), noise(), paint.pen("#204060"))
    else:
        paint.envelope(painter, frame(), noise(), "#204060")
    pen, zoom = painter.pen(), painter.deviceTransform().m11()
    painter.end()
    assert zoom == pytest.approx(ratio)
    assert pen.widthF() * (1 if pen.isCosmetic() else zoom) <= 1
    assert lit(image).any()


@pytest.mark.parametrize("ratio", [1, 2, 3])
def test_a_line_is_as_thick_as_the_screen_is_fine(app, ratio: int):
    image, painter = onto(ratio)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    x = np.array([0.0, WIDE])
    line = paint.pen(QColor("black").name())
    paint.polyline(painter, x, np.full(2, 20.5), line)
    painter.end()
    assert lit(image)[:, image.width() // 2].sum() == pytest.approx(ratio * 255, abs=8)


@pytest.mark.parametrize("ratio", [1, 1.25, 1.5, 2])
def test_the_area_between_extremes_has_no_gaps(app, ratio: float):
    image, painter = onto(ratio)
    paint.envelope(painter, frame(), noise(), "#204060")
    painter.end()
    middle = lit(image)[round(21 * ratio), round(2 * ratio) : round(-2 * ratio)]
    assert middle.all()
