"""The header's chips: as much of each as fits, and nothing moves with a number."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from PySide6.QtWidgets import QApplication, QWidget

from gui.header.header import Header
from gui.state import InstrumentView, Lamp, Snapshot, WindowState

VIEWS = (
    InstrumentView("Coil source", Lamp.ACTIVE, "output on · ≤ 2 A", "798 mA"),
    InstrumentView("Oscilloscope", Lamp.ACTIVE, "4 channels · 8 bit", "1 MS/s"),
    InstrumentView("Thermometer", Lamp.ACTIVE, "LSCI MODEL335", "296.15 K"),
    InstrumentView("Teslameter", Lamp.ACTIVE, "LSCI MODEL425", "8.78 mT"),
    InstrumentView("Model", Lamp.WARNING, "beside the run", "NRMSE 12.3 %"),
)
SOURCED = (
    InstrumentView("Source of V_th", Lamp.ACTIVE, "to hold 3.213 V", "3.2130 V"),
    InstrumentView("Source of V_GS", Lamp.ACTIVE, "to hold 1.4051 V", "1.40512 V"),
)
SHOWN = Snapshot(WindowState.RUNNING, "bench", True, "2026-11-21_120000_demo")


@pytest.fixture
def header(lab) -> Iterator[Header]:
    host = QWidget()  # by itself it would be a window, which its layout resizes
    made = Header(lab.window.theme)
    made.setParent(host)
    made.resize(1720, 68)
    host.show()
    yield made
    host.close()


@pytest.mark.parametrize("width", [844, 1024, 1280, 1450, 1720])
@pytest.mark.parametrize("count", [2, 4, 6, 7])
def test_no_chip_is_cut_at_any_width(
    app: QApplication, header: Header, width: int, count: int
) -> None:
    header.resize(width, 68)
    header.render_snapshot(replace(SHOWN, instruments=(*SOURCED, *VIEWS)[-count:]))
    app.processEvents()
    assert len(header.chips) == count
    assert header.minimumSizeHint().width() <= width
    for chip in header.chips:
        assert chip.width() >= chip.minimumSizeHint().width(), chip.accessibleName()
        if not chip.value.isHidden():
            assert chip.value.width() >= chip.value.sizeHint().width()


def test_a_narrow_title_ends_with_what_tells_most(
    app: QApplication, header: Header
) -> None:
    """It was cut to "Looking at 2026-11-2…"."""
    run = "2026-11-23_115548_demo"
    header.resize(1280, 68)
    header.render_snapshot(replace(SHOWN, title=run, opened=1, instruments=VIEWS))
    app.processEvents()
    said = header._title.text()
    assert said.removeprefix("…") and run.endswith(said.removeprefix("…"))


def test_wide_chips_say_more(app: QApplication, header: Header) -> None:
    widths = []
    four = (*VIEWS[:2], *VIEWS[3:])
    for width in (1180, 1450, 1720):
        header.resize(width, 68)
        header.render_snapshot(replace(SHOWN, instruments=four))
        app.processEvents()
        widths.append(sum(chip.width() for chip in header.chips))
    assert widths == sorted(widths) and len(set(widths)) == 3


def test_chips_keep_their_place_while_numbers_change(
    app: QApplication, header: Header
) -> None:
    header.render_snapshot(replace(SHOWN, instruments=VIEWS))
    app.processEvents()
    places = [chip.geometry() for chip in header.chips]
    smaller = (replace(VIEWS[0], value="0 mA"), *VIEWS[1:])
    header.render_snapshot(replace(SHOWN, instruments=smaller))
    app.processEvents()
    assert [chip.geometry() for chip in header.chips] == places
