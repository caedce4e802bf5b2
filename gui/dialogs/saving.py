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
from gui.lanes.compare import MARKS, Comparison
from gui.lanes.decimate import FloatArray
from gui.lanes.derive import rate_of
from gui.lanes.expected import starts
from gui.lanes.lane import Kind, Lane
from gui.lanes.row import LaneRow
from gui.lanes.source import Source
from gui.lanes.stack import LaneStack
from gui.lanes.view import TimeView
from gui.look.fonts import sized
from gui.look.tokens import LIGHT, Tokens
from gui.session.messages import Level
from gui.setup.texts import FieldError
from tactile_lab.errors import TactileLabError

if TYPE_CHECKING:
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
    if isinstance(stack.source, Comparison):
        _legend(painter, stack.source, tokens, size.width() - 12)
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


def _legend(
    painter: QPainter, comparison: Comparison, tokens: Tokens, right: int
) -> None:
    """Marker and name of each run, beside the title."""
    names = [
        f"{m} {one.name}" for m, one in zip(MARKS, comparison.members, strict=False)
    ]
    for name, colour in zip(
        reversed(names), reversed(tokens.runs[: len(names)]), strict=True
    ):
        width = painter.fontMetrics().horizontalAdvance(name)
        painter.setPen(QColor(colour))
        right -= width
        painter.drawText(QRectF(right, 6, width + 2, 22), name)
        right -= 16


def _card(painter: QPainter, row: LaneRow, tokens: Tokens) -> None:
    kind = row.lane.kind
    name = "residual" if kind is Kind.RESIDUAL else row.lane.signal
    # in a comparison colour means run
    grey = isinstance(row.plot.source, Comparison)
    swatch = QColor(tokens.border_strong if grey else tokens.trace(name))
    painter.fillRect(QRectF(12, 9, 10, 10), swatch)
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
    end early. Of compared runs each has columns, on the common time.
    """
    source, columns = stack.source, []
    runs: list[tuple[str, Source, float]] = [("", source, 0.0)]
    if isinstance(source, Comparison):
        runs = [
            (f"run{k}_", m.source, m.shift) for k, m in enumerate(source.members, 1)
        ]
        names = (f"run{k} {m.name}" for k, m in enumerate(source.members, 1))
        title = "; ".join([title, *names])
    for row in stack.visible_rows():
        if row.lane.kind is not Kind.RESIDUAL:
            for prefix, run, shift in runs:
                found = _columns(row.lane, run, stack.view, shift)
                columns += [(prefix + name, values) for name, values in found]
    height = max((values.size for _, values in columns), default=0)
    lines = [f"# {title}; SI units", ",".join(name for name, _ in columns)]
    for at in range(height):
        lines.append(
            ",".join(f"{v[at]:.9g}" if at < v.size else "" for _, v in columns)
        )
    return "\n".join(lines) + "\n"


def _columns(
    lane: Lane, source: Source, view: TimeView, shift: float
) -> list[tuple[str, FloatArray]]:
    """Names and values of a lane's columns, `shift` s later than in the run."""
    start, end = view.start - shift, view.end - shift
    if lane.kind is Kind.RASTER:
        first, last = np.searchsorted(source.spikes, [start, end])
        return [("spikes_s", source.spikes[first:last] + shift)]
    if lane.kind is Kind.RATE:
        drawn = rate_of(source.spikes, start, end, 1 << 20, starts(source.holds))
    else:
        drawn = source.trace(lane.signal, start, end, CSV_POINTS)
    unit = {"mN": "N", "mV": "V", "mA": "A", "nA": "A", "mT": "T"}.get(
        lane.unit, lane.unit
    )
    return [
        (f"{lane.signal}_time_s", drawn.time + shift),
        (f"{lane.signal}_mean_{unit}", drawn.mean),
        (f"{lane.signal}_min_{unit}", drawn.low),
        (f"{lane.signal}_max_{unit}", drawn.high),
    ]
