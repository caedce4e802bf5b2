"""Line icons, drawn on a 24 x 24 grid, tinted with any colour, sharp at any scale."""
# ruff: noqa: E501

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path

from PySide6.QtCore import QByteArray, QRectF, Qt
from PySide6.QtGui import QIcon, QPainter, QPixmap
from PySide6.QtSvg import QSvgRenderer

_PATHS = {
    "play": '<path d="M7 4.5v15l12-7.5z" fill="{c}" stroke="none"/>',
    "queue": '<path d="M4 6h16M4 12h9M4 18h9M18 12v8M14 16h8"/>',
    "star": '<path d="M12 3.5l2.6 5.4 5.9.8-4.3 4.1 1 5.9-5.2-2.8-5.2 2.8 1-5.9'
    '-4.3-4.1 5.9-.8z"/>',
    "starred": '<path d="M12 3.5l2.6 5.4 5.9.8-4.3 4.1 1 5.9-5.2-2.8-5.2 2.8 1-5.9'
    '-4.3-4.1 5.9-.8z" fill="{c}"/>',
    "undo": '<path d="M4 12a8 8 0 1 0 2.6-5.9M4 4v5h5"/>',
    "refresh": '<path d="M20 12a8 8 0 0 1-14 5.3M4 12a8 8 0 0 1 14-5.3M18 2.5v4.2h-4.2'
    'M6 21.5v-4.2h4.2"/>',
    "follow": '<path d="M3 12h14M12 6.5l5.5 5.5-5.5 5.5M21 4v16"/>',
    "fit": '<path d="M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5"/>',
    "zoom": '<circle cx="10.5" cy="10.5" r="6.5"/><path d="M15.5 15.5L21 21'
    'M7.5 10.5h6M10.5 7.5v6"/>',
    "cursors": '<path d="M7 3v18M17 3v18M7 12h10"/>',
    "twin": '<path d="M3 17c3 0 4-10 7-10s3 8 6 8 3-4 5-4"/>'
    '<path d="M3 20h18" stroke-dasharray="2 3"/>',
    "residual": '<path d="M3 12h3l2-5 3 10 3-12 3 10 1-3h3"/>',
    "freeze": '<path d="M8 5v14M16 5v14"/>',
    "camera": '<path d="M4 8h3.5L9 5.5h6L16.5 8H20v11H4z"/>'
    '<circle cx="12" cy="13" r="3.5"/>',
    "settings": '<circle cx="12" cy="12" r="3.2"/><path d="M12 3v3M12 18v3M3 12h3M18 12'
    'h3M5.6 5.6l2.1 2.1M16.3 16.3l2.1 2.1M18.4 5.6l-2.1 2.1M7.7 16.3l-2.1 2.1"/>',
    "help": '<circle cx="12" cy="12" r="9"/><path d="M9.3 9.3a2.8 2.8 0 1 1 4 2.6c-.9.4'
    '-1.3 1-1.3 2"/><path d="M12 17.2v.1"/>',
    "export": '<path d="M12 15V4M7.5 8L12 3.5 16.5 8M4 14v6h16v-6"/>',
    "close": '<path d="M6 6l12 12M18 6L6 18"/>',
    "up": '<path d="M12 19V5M6 11l6-6 6 6"/>',
    "down": '<path d="M12 5v14M6 13l6 6 6-6"/>',
    "eye": '<path d="M2.5 12S6 5.5 12 5.5 21.5 12 21.5 12 18 18.5 12 18.5 2.5 12 2.5 12z'
    '"/><circle cx="12" cy="12" r="3"/>',
    "info": '<circle cx="12" cy="12" r="9"/><path d="M12 11v6M12 7.5v.1"/>',
    "warning": '<path d="M12 3.5L22 20.5H2zM12 10v5M12 17.6v.1"/>',
    "error": '<path d="M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8zM8.5 8.5l7 7M15.5 8.5l-7 7"/>',
    "check": '<circle cx="12" cy="12" r="9"/><path d="M8 12.5l2.8 2.8L16.2 9.5"/>',
    "tick": '<path d="M5 12.5l4.5 4.5L19 7.5" stroke-width="3"/>',
    "note": '<path d="M4 4h16v11l-5 5H4zM15 20v-5h5M8 9h8M8 13h4"/>',
    "edit": '<path d="M4 20l1-4.5L16.5 4l3.5 3.5L8.5 19zM14 6.5l3.5 3.5"/>',
    "chevron-right": '<path d="M9 6l6 6-6 6"/>',
    "chevron": '<path d="M6 9l6 6 6-6"/>',
    "folder": '<path d="M3 6h6l2 2.5h10V19H3z"/>',
    "file": '<path d="M6 3h8l4 4v14H6zM14 3v4h4"/>',
    "plug": '<path d="M9 3v5M15 3v5M6 8h12v3a6 6 0 0 1-12 0zM12 17v4"/>',
    "bench": '<rect x="3" y="4" width="18" height="13" rx="2"/>'
    '<path d="M6 11c2 0 2-4 4-4s2 7 4 7 2-3 4-3M9 21h6"/>',
    "logo": '<path d="M2.5 17h4c2.5 0 3-10 5.5-10s3 10 5.5 10h4"/>'
    '<circle cx="12" cy="3.6" r=".6"/>',
    "panel-left": '<rect x="3" y="4" width="18" height="16" rx="2"/><path d="M9.5 4v16"/>',
    "panel-right": '<rect x="3" y="4" width="18" height="16" rx="2"/>'
    '<path d="M14.5 4v16"/>',
    "layers": '<path d="M12 3l9 5-9 5-9-5zM3 12.5l9 5 9-5"/>',
    "lamp-absent": '<g stroke-width="2.4"><circle cx="12" cy="12" r="8"/>'
    '<path d="M6.7 17.3L17.3 6.7"/></g>',
    "lamp-waiting": '<path d="M19.5 9.3A8 8 0 1 0 14.7 19.5" stroke-width="2.4"/>',
    "lamp-good": '<circle cx="12" cy="12" r="8" fill="{c}" stroke-width="2.4"/>'
    '<path d="M8 12.3L10.9 15.2 16 9.1" stroke="#141414" stroke-width="2.7" '
    'stroke-linecap="square" stroke-linejoin="bevel"/>',
    "lamp-active": '<g fill="{c}" stroke="none"><circle cx="12" cy="12" r="10.7" '
    'fill-opacity="0.27"/><circle cx="12" cy="12" r="5.3"/></g>',
    "lamp-warning": '<g stroke-width="2.4"><path d="M12 3.3L21.3 20.7H2.7z" '
    'stroke-linejoin="bevel"/><path d="M12 9.3V14.7M12 17.9v.1"/></g>',
    "lamp-bad": '<g stroke-width="2.4"><path d="M12 3.3L21.3 20.7H2.7z" fill="{c}" '
    'stroke-linejoin="bevel"/><path d="M12 9.3V14.7M12 17.9v.1" stroke="#141414"/></g>',
}


def svg(name: str, colour: str) -> bytes:
    """The icon as SVG text."""
    inner = _PATHS[name].replace("{c}", colour)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" fill="none" '
        f'stroke="{colour}" stroke-width="1.8" stroke-linecap="round" '
        f'stroke-linejoin="round">{inner}</svg>'
    ).encode()


@lru_cache(maxsize=512)
def pixmap(name: str, colour: str, size: int = 18) -> QPixmap:
    """The icon as a pixmap of `size` px, sharp on a screen of twice as many."""
    made = QPixmap(2 * size, 2 * size)
    made.fill(Qt.GlobalColor.transparent)
    painter = QPainter(made)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    QSvgRenderer(QByteArray(svg(name, colour))).render(
        painter, QRectF(0, 0, 2 * size, 2 * size)
    )
    painter.end()
    made.setDevicePixelRatio(2)
    return made


def icon(name: str, colour: str, checked: str | None = None) -> QIcon:
    """The icon for a button, in another colour where the button is checked."""
    made = QIcon(pixmap(name, colour, 18))
    if checked is not None:
        made.addPixmap(pixmap(name, checked, 18), QIcon.Mode.Normal, QIcon.State.On)
    return made


@lru_cache(maxsize=1)
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="tactile-lab-icons-")


@lru_cache(maxsize=64)
def file_of(name: str, colour: str) -> str:
    """Path of the icon as a file: style sheets take images from files only."""
    file = Path(_folder().name) / f"{name}-{colour[1:]}.svg"
    file.write_bytes(svg(name, colour))
    return file.as_posix()
