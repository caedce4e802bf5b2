"""Saving the form as a scene, and what the lanes show as PNG, SVG or CSV."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QImage, QPainter
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtWidgets import QFileDialog

from gui.lanes.card import CARD
from gui.lanes.derive import rate_of
from gui.lanes.expected import starts
from gui.lanes.lane import Kind
from gui.lanes.row import LaneRow
from gui.lanes.stack import LaneStack
from gui.look.fonts import sized
from gui.look.tokens import LIGHT, Tokens
from gui.session.messages import Level
from gui.setup.texts import FieldError
from tactile_lab.errors import TactileLabError

if TYPE_CHECKING:
    from gui.lanes.compare import Comparison
    from gui.lanes.stored import RunSource
    from gui.panels import Panels

TITLE = 34
CSV_POINTS = 20_000


def save_scene(panels: Panels) -> None:
    """Ask where, and write the form as a scene with every key expanded."""
    name, _ = QFileDialog.getSaveFileName(
        panels.centre.window(),
        "Save the scene",
        f"{panels.setup.kind_name}.toml",
        "Scenes (*.toml)",
    )
    if name:
        write_scene(panels, Path(name))


def write_scene(panels: Panels, path: Path) -> None:
    """Write the form as a scene."""
    try:
        path.write_text(panels.setup.request().load().to_toml(), encoding="utf-8")
    except (TactileLabError, FieldError, OSError) as error:
        panels.session.log(Level.ERROR, "scene", f"{path} was not saved: {error}")
    else:
        panels.session.log(Level.GOOD, "scene", f"Saved {path}")


def export_view(panels: Panels, run: RunSource | Comparison | None) -> None:
    """Ask where, and export what the lanes show; `run` is from disk."""
    name, _ = QFileDialog.getSaveFileName(
        panels.centre.window(),
        "Export this view",
        "view.png",
        "Picture (*.png *.svg);;Table (*.csv)",
    )
    if name:
        write_view(panels, run, Path(name))


def write_view(panels: Panels, run: RunSource | Comparison | None, path: Path) -> None:
    """Write the visible time of all visible lanes; the ending chooses the format."""
    stack = panels.centre.stack
    simulated = panels.session.spec is None or panels.session.spec.simulated
    if run is not None:
        simulated = run.simulated
    title = panels.session.run_name or "plan"
    title += " · SIMULATED" if simulated else " · measured"
    try:
        if path.suffix == ".csv":
            path.write_text(table(stack, title), encoding="utf-8")
        elif path.suffix == ".svg":
            _svg(stack, title, path)
        elif not picture(stack, title).save(str(path)):
            raise OSError(f"{path} cannot be written as a picture; end it in .png.")
    except OSError as error:
        panels.session.log(Level.ERROR, "export", f"The view was not exported: {error}")
    else:
        panels.session.log(Level.GOOD, "export", f"View exported to {path}")


def picture(stack: LaneStack, title: str, scale: int = 2) -> QImage:
    """The lanes as a picture on white, twice as fine as on screen."""
    size = _size(stack)
    image = QImage(size * scale, QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(QColor(LIGHT.plot))
    painter = QPainter(image)
    painter.scale(scale, scale)
    _draw(painter, stack, title, size)
    painter.end()
    return image


def _svg(stack: LaneStack, title: str, path: Path) -> None:
    size = _size(stack)
    generator = QSvgGenerator()
    generator.setFileName(str(path))
    generator.setSize(size)
    generator.setViewBox(QRect(0, 0, size.width(), size.height()))
    generator.setTitle(title)
    painter = QPainter()
    if not painter.begin(generator):
        raise OSError(f"{path} cannot be written.")
    _draw(painter, stack, title, size)
    painter.end()


def _size(stack: LaneStack) -> QSize:
    rows = stack.visible_rows()
    height = sum(row.height() for row in rows) + TITLE
    return QSize(max(stack.width(), 700), max(height, 200))


def _draw(painter: QPainter, stack: LaneStack, title: str, size: QSize) -> None:
    tokens = LIGHT
    painter.setPen(QColor(tokens.text))
    painter.setFont(sized(14, QFont.Weight.DemiBold))
    painter.drawText(QRectF(12, 6, size.width() - 24, 22), title)
    top = TITLE
    for row in stack.visible_rows():
        painter.save()
        painter.translate(0, top)
        _card(painter, row, tokens)
        painter.translate(CARD, 0)
        painter.setClipRect(QRectF(0, 0, size.width() - CARD, row.height()))
        inner = QSize(size.width() - CARD, row.height())
        row.plot.painter.paint(painter, inner, stack.source, tokens)
        painter.restore()
        top += row.height()


def _card(painter: QPainter, row: LaneRow, tokens: Tokens) -> None:
    kind = row.lane.kind
    name = "residual" if kind is Kind.RESIDUAL else row.lane.signal
    painter.fillRect(QRectF(12, 9, 10, 10), QColor(tokens.trace(name)))
    painter.setPen(QColor(tokens.text))
    painter.setFont(sized(13, QFont.Weight.DemiBold))
    unit = f" / {row.lane.unit}" if row.lane.unit else ""
    short = "Residual" if kind is Kind.RESIDUAL else row.lane.plain
    painter.drawText(
        QRectF(29, 4, CARD - 32, 20), Qt.AlignmentFlag.AlignVCenter, short + unit
    )


def table(stack: LaneStack, title: str) -> str:
    """The visible time as CSV in SI: columns for each lane, units in the header.

    Lanes have times of their own, so each has its own time column; shorter columns
    end early.
    """
    view, columns = stack.view, []
    for row in stack.visible_rows():
        lane, source = row.lane, stack.source
        if lane.kind is Kind.RESIDUAL:
            continue
        if lane.kind is Kind.RASTER:
            first, last = np.searchsorted(source.spikes, [view.start, view.end])
            columns.append(("spikes_s", source.spikes[first:last]))
            continue
        if lane.kind is Kind.RATE:
            steps = starts(source.holds)
            drawn = rate_of(source.spikes, view.start, view.end, 1 << 20, steps)
        else:
            drawn = source.trace(lane.signal, view.start, view.end, CSV_POINTS)
        unit = {"mN": "N", "mV": "V", "mA": "A", "nA": "A", "mT": "T"}.get(
            lane.unit, lane.unit
        )
        columns.append((f"{lane.signal}_time_s", drawn.time))
        for name, values in (
            ("mean", drawn.mean),
            ("min", drawn.low),
            ("max", drawn.high),
        ):
            columns.append((f"{lane.signal}_{name}_{unit}", values))
    height = max((values.size for _, values in columns), default=0)
    lines = [f"# {title}; SI units", ",".join(name for name, _ in columns)]
    for at in range(height):
        lines.append(
            ",".join(f"{v[at]:.9g}" if at < v.size else "" for _, v in columns)
        )
    return "\n".join(lines) + "\n"
