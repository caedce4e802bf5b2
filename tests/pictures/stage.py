"""A window to be pictured, and what is attached to the computer it is pictured on."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple, cast
from unittest.mock import patch

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PIL import Image
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QImage, QPixmap
from PySide6.QtWidgets import QApplication

from drivers.usb_presence import PICO, Present
from gui.app import application, begin
from gui.dialogs.overlay import Overlay
from gui.look.theme import Theme
from gui.session.session import Session
from gui.state import WindowState
from gui.window import Window

SIZE = (1720, 1080)

FILM, STEP, FORMAT = 1032, 0.25, QImage.Format.Format_RGB888
"""Width of a film, px; seconds between two of its frames; and how they are read."""
LEVELS = 6
"""Layouts within each other that a change of a text goes through."""


class Port(NamedTuple):
    """A serial port as the system lists it."""

    device: str
    description: str
    vid: int
    pid: int
    serial_number: str = ""


SCOPE = Present(
    vendor=PICO,
    product=0x1012,
    bus=2,
    address=5,
    speed=4,
    title="PicoScope 3404D",
    serial="SIM04/0001",
    usbtmc=False,
    readable=True,
)


class Stage:
    """A window on a bench and the means to wait for it.

    Args:
        folder: for the pictures.
        bench: as for `gui.app.begin`.
        scene: the same.
        realtime: pace the simulated bench by the wall clock.
    """

    def __init__(
        self,
        folder: Path,
        bench: str | None,
        scene: str | None = None,
        *,
        realtime: bool = True,
    ) -> None:
        self.app: QApplication = application([])
        self.theme = Theme("light")
        self.theme.apply()
        self.session = Session(Path("runs"), realtime=realtime)
        self.window = Window(self.session, self.theme)
        self.window.resize(*SIZE)
        self.window.show()
        self.folder = folder
        begin(self.window, scene, bench)

    def until(self, done: Callable[[], object], longest: float = 300.0) -> None:
        """Let the window live until `done()`.

        Raises:
            SystemExit: it never was; the last lines of the log say why.
        """
        end = time.monotonic() + longest
        while not done():
            if time.monotonic() > end:
                raise SystemExit("\n".join(x.text for x in self.session.log.lines[-8:]))
            self.app.processEvents()
            time.sleep(0.004)

    def live(self, seconds: float) -> None:
        """Let the window live for so long."""
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() > end, seconds + 60)

    def shoot(self, name: str, theme: str = "light") -> None:
        """Save a picture."""
        if self.theme.choice != theme:
            self.theme.choose(theme)
        self.live(0.15)
        file = self.folder / f"{name}.png"
        seen = self._grabbed().toImage().convertToFormat(FORMAT)
        _in_256_colours(_image(seen)).save(file, optimize=True)
        print(file, flush=True)

    def _grabbed(self) -> QPixmap:
        """The window, once all in it has its place, as a screen paints it."""
        for _ in range(LEVELS):
            self.app.sendPostedEvents(None, QEvent.Type.LayoutRequest.value)
        return self.window.grab()

    def film(self, name: str, ended: Callable[[], object]) -> None:
        """Save an animated picture of all until `ended()`, twice as fast as it was."""
        frames, times = [], [time.monotonic()]
        while not ended():
            self.live(STEP)
            times.append(time.monotonic())
            image = self._grabbed().toImage().convertToFormat(FORMAT)
            image = image.scaledToWidth(
                FILM, Qt.TransformationMode.SmoothTransformation
            )
            frames.append(_image(image))
        file = self.folder / f"{name}.webp"
        frames[0].save(
            file, save_all=True, append_images=frames[1:], quality=60, method=4,
            duration=[*(int(500 * s) for s in np.diff(times[1:])), 3000], loop=0,
        )  # fmt: skip
        print(file, flush=True)

    def planned(self) -> None:
        """Wait for bench and plan."""
        session = self.session
        session.plan.expectation = None
        self.window.setup.plan_now()
        self.until(
            lambda: session.plan.expectation and session.state is WindowState.READY
        )
        self.live(0.4)

    def run(self) -> None:
        """A whole run of what the form shows, to its report."""
        session = self.session
        self.planned()
        self.window.setup.start()
        self.until(lambda: session.state is WindowState.RUNNING)
        self.ended()

    def ended(self) -> None:
        """Wait for the end of the run in progress, which must be complete."""
        self.until(lambda: not self.session.busy)
        self.live(0.5)
        if not self.window.screen_.ending.startswith("Complete"):
            raise SystemExit(f"The run was not completed: {self.session.status.fault}")

    def close_overlays(self) -> None:
        """Close every card above the window."""
        for overlay in self.window.findChildren(Overlay):
            overlay.hide()

    def close(self) -> None:
        """Close the window and end its engine."""
        self.window.close()
        self.session.close()


def _image(seen: QImage) -> Image.Image:
    """The same, in `FORMAT`, as Pillow has it."""
    rows = seen.constBits(), "raw", "RGB", seen.bytesPerLine()
    return Image.frombytes("RGB", (seen.width(), seen.height()), *rows)


def _in_256_colours(picture: Image.Image) -> Image.Image:
    """The commonest as they are, for what is flat, and some for all other hues."""
    found = picture.getcolors(1 << 24) or []
    ranked = sorted(cast(list[tuple[int, tuple[int, int, int]]], found))
    common = [part for _, colour in ranked[:-193:-1] for part in colour]
    others = picture.quantize(64, Image.Quantize.MAXCOVERAGE).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*common, *others[:192]])
    return picture.quantize(palette=palette, dither=Image.Dither.NONE)


@contextmanager
def instruments_attached() -> Iterator[None]:
    """A source and a teslameter at serial ports, and a scope at the USB, for a while.

    Both are served on pseudo-terminals, which no computer lists as its ports.
    """
    serving = subprocess.Popen(
        [sys.executable, "-m", "tactile_lab", "serve-bench", "--json"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert serving.stdout is not None
    served = json.loads(serving.stdout.readline())
    ports = [
        Port(served["coil"], "USB-Serial Controller", 0x067B, 0x2303),
        Port(served["teslameter"], "CP2102 USB to UART Bridge", 0x10C4, 0xEA60),
    ]
    try:
        with (
            patch("serial.tools.list_ports.comports", return_value=ports),
            patch("drivers.attached.present", return_value=(SCOPE,)),
        ):
            yield
    finally:
        serving.terminate()
        serving.wait()
        serving.stdout.close()
