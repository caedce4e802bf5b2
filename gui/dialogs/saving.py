"""Saving the form as a scene, and what the lanes show as PNG, SVG or CSV."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QBuffer, QByteArray, QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFont,
    QImage,
    QImageWriter,
    QPainter,
    QStaticText,
    QTransform,
)
from PySide6.QtSvg import QSvgGenerator

from gui.ask_file import ask_file
from gui.lanes.card import CARD
from gui.lanes.compare import MARKS
from gui.lanes.lane import Lane
from gui.lanes.row import LaneRow
from gui.lanes.source import Member, Source
from gui.lanes.stack import LaneStack
from gui.lanes.view import TimeView
from gui.look.fonts import sized
from gui.look.tokens import LIGHT, Tokens
from gui.session.log import Severity
from gui.setup.parameter import FieldError
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RecordingError, TactileLabError
from tactile_lab.store.folder import refuse_own
from tactile_lab.trace import Trace
from tactile_lab.whole_file import failing_as, replacing, write_text

if TYPE_CHECKING:
    from gui.screen.panels import Panels

TITLE, LEGEND = 34, 20
"""Heights of the title, and of the names of several runs below it, px."""

CSV_POINTS = 20_000


def save_scene(panels: Panels) -> None:
    """Ask where, and write the form as a scene with every key expanded."""
    ask_file(
        panels.centre.window(),
        "Save the scene",
        lambda path: write_scene(panels, path),
        kinds="Scenes (*.toml)",
        start=f"{panels.setup.kind_name}.toml",
        save=True,
    )


def write_scene(panels: Panels, path: Path) -> None:
    """Write the form as a scene."""
    with _telling(panels, "scene", path):
        refuse_own(path)
        write_text(path, panels.setup.request().load().to_toml())


def export_view(panels: Panels) -> None:
    """Ask where, and export what the lanes show by then."""
    ask_file(
        panels.centre.window(),
        "Export this view",
        lambda path: write_view(panels, path),
        kinds="Picture or table (*.png *.svg *.csv)",
        start="view.png",
        save=True,
    )


def write_view(panels: Panels, path: Path) -> None:
    """Write the visible time of all visible lanes; the ending chooses the format."""
    stack = panels.centre.stack
    title = panels.session.name or "plan"
    bar = panels.centre.compare_bar
    if bar.comparison is not None and bar.comparison is stack.source:
        title += f", {bar.comparison.layout.value}"
    title += " · SIMULATED" if stack.source.simulated else " · measured"
    with _telling(panels, "export", path):
        data = _exported(stack, title, path.suffix.lower())
        with replacing(path, len(data)) as part:
            part.write_bytes(data)


def _exported(stack: LaneStack, title: str, ending: str) -> bytes:
    """What a file of that ending holds.

    Raises:
        RecordingError: no picture has that ending.
    """
    if ending == ".csv":
        return table(stack, title).encode()
    if ending == ".svg":
        return _svg(stack, title)
    kind = QByteArray(ending[1:].encode())
    if kind not in QImageWriter.supportedImageFormats():
        raise RecordingError(
            f"no picture ends in {ending!r}. End it in .png, .svg or .csv."
        )
    written = QBuffer()
    written.open(QBuffer.OpenModeFlag.WriteOnly)
    QImageWriter(written, kind).write(picture(stack, title))
    return bytes(written.data().data())


@contextmanager
def _telling(panels: Panels, source: str, path: Path) -> Iterator[None]:
    """Say in the log whether a file was saved, and above the lanes that it was not."""
    try:
        with failing_as(f"{path} was not saved", "Choose another folder or disk."):
            yield
    except (TactileLabError, FieldError) as error:
        why = str(error)
        said = why if str(path) in why else f"{path} was not saved: {why}"
        panels.session.log.add(Severity.ERROR, source, said)
        panels.centre.say(said)
    else:
        panels.session.log.add(Severity.GOOD, source, f"Saved {path}")
        panels.centre.say("")


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


def _svg(stack: LaneStack, title: str) -> bytes:
    size = _size(stack)
    written = QBuffer()
    generator = QSvgGenerator()
    generator.setOutputDevice(written)
    generator.setSize(size)
    generator.setViewBox(QRect(0, 0, size.width(), size.height()))
    generator.setTitle(title)
    painter = QPainter(generator)
    _draw(painter, stack, title, size)
    painter.end()
    return bytes(written.data().data())


def _size(stack: LaneStack) -> QSize:
    scene = stack.scene
    return QSize(CARD + scene.width(), _above(stack) + scene.height())


def _above(stack: LaneStack) -> int:
    """Height of what stands above the lanes, px."""
    return TITLE + (LEGEND if len(stack.source.members) > 1 else 0)


def _draw(painter: QPainter, stack: LaneStack, title: str, size: QSize) -> None:
    tokens = LIGHT
    painter.setPen(QColor(tokens.text))
    painter.setFont(sized(14, QFont.Weight.DemiBold))
    painter.drawText(QRectF(12, 6, size.width() - 24, 22), title)
    if len(stack.source.members) > 1:
        _legend(painter, stack.source, tokens, size.width() - 24)
    scene, above = stack.scene, _above(stack)
    lanes = QRectF(CARD, above, scene.width(), scene.height())
    scene.draw_onto(painter, lanes, tokens)
    for row in stack.visible_rows():
        painter.save()
        painter.translate(0, above + row.card.y())
        _card(painter, row, len(stack.source.members) > 1, tokens)
        painter.restore()


def _legend(painter: QPainter, source: Source, tokens: Tokens, room: int) -> None:
    """Marker and name of each run below the title, each with its share of the room."""
    each, metrics = room // len(source.members), painter.fontMetrics()
    left, end = 12, Qt.TextElideMode.ElideRight
    for mark, one, colour in zip(MARKS, source.members, tokens.runs, strict=False):
        name = metrics.elidedText(f"{mark} {one.name}", end, each - 16)
        painter.setPen(QColor(colour))
        painter.drawText(QRectF(left, TITLE - 6, each, 22), name)
        left += metrics.horizontalAdvance(name) + 16


def _card(painter: QPainter, row: LaneRow, grey: bool, tokens: Tokens) -> None:
    """A lane's name and colour; grey in a comparison, where colour means run."""
    lane = row.lane
    swatch = QColor(tokens.border_strong if grey else tokens.trace(lane.key))
    painter.fillRect(QRectF(12, 9, 10, 10), swatch)
    painter.setPen(QColor(tokens.text))
    painter.setFont(sized(13, QFont.Weight.DemiBold))
    unit = f" / {lane.unit}" if lane.unit else ""
    words = QStaticText(lane.title + unit)  # V_C1 with its subscript, as on screen
    words.setTextFormat(Qt.TextFormat.RichText)
    words.prepare(QTransform(), painter.font())
    painter.drawStaticText(QPointF(29, 14 - words.size().height() / 2), words)


def table(stack: LaneStack, title: str) -> str:
    """The visible time as CSV in SI: columns for each lane, units in the header.

    Lanes have times of their own, so each has its own time column; shorter columns
    end early. What is shown of the model stands beside what was measured. Of compared
    runs each has columns, on the common time; where the first is taken from them, the
    columns say so.
    """
    source, view = stack.source, stack.view
    members, columns = source.members, []
    for row in stack.visible_rows():
        if not row.lane.raster:
            source.shown(row.lane, view.start, view.end, CSV_POINTS)
    source.read_all()  # what that asked for: lanes are content with coarser samples
    for row in stack.visible_rows():
        lane = row.lane
        if lane.raster:
            columns += _spikes(members, view)
            continue
        fine = replace(lane, scale=1.0)
        count = 1 << 20 if lane.key == "rate" else CSV_POINTS
        traces = source.shown(fine, view.start, view.end, count)
        for number, found in enumerate(traces, 1):
            prefix = f"run{number}_" if len(members) > 1 else ""
            if source.subtracts(lane):
                prefix = f"run{number}_less_run1_"
                if number == 1:
                    continue  # nothing is left of it
            columns += _columns(prefix + lane.key, lane, found)
        if len(members) == 1 and stack.stage.twin and lane.key != "residual":
            modelled = source.twin(lane.key, view.start, view.end, count)
            if not modelled.empty:
                columns += _columns(f"model_{lane.key}", lane, modelled)
    if len(members) > 1:
        names = (f"run{number} {one.name}" for number, one in enumerate(members, 1))
        title = "; ".join([title, *names])
    lines = [f"# {title}; SI units", ",".join(name for name, _ in columns)]
    # as numbers of Python's own: numpy's take twice as long to print
    cells = [[f"{x:.9g}" for x in values.tolist()] for _, values in columns]
    lines += map(",".join, zip_longest(*cells, fillvalue=""))
    return "\n".join(lines) + "\n"


def _spikes(members: Sequence[Member], view: TimeView) -> list[tuple[str, FloatArray]]:
    """A column of spike times for each run, s."""
    found = []
    for number, member in enumerate(members, 1):
        first, last = np.searchsorted(member.spikes, [view.start, view.end])
        prefix = f"run{number}_" if len(members) > 1 else ""
        found.append((f"{prefix}spikes_s", member.spikes[first:last]))
    return found


def _columns(name: str, lane: Lane, found: Trace) -> list[tuple[str, FloatArray]]:
    """Names and values of a trace's columns, SI."""
    units = {"mN": "N", "mV": "V", "mA": "A", "nA": "A", "mT": "T"}
    unit = units.get(lane.unit, lane.unit)
    return [
        (f"{name}_time_s", found.time),
        (f"{name}_mean_{unit}", found.mean),
        (f"{name}_min_{unit}", found.low),
        (f"{name}_max_{unit}", found.high),
    ]
