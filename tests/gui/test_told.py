"""What somebody asked for and does not get is told where the log is not seen, too."""

from pathlib import Path

import pytest

from gui.state import WindowState
from tactile_lab.acquisition.events import Message

BENCH = """
name = "of its own"
simulated = true
[coil]
baud = 19200
[magnet]
r = "6 mm"
[field_meter]
"""


@pytest.fixture
def gone(lab, tmp_path: Path):
    """A bench whose file cannot be read any more."""
    bench = tmp_path / "bench.toml"
    bench.write_text(BENCH)
    lab.session.connect_bench(str(bench))
    lab.until(lambda: lab.session.state is WindowState.READY)
    bench.write_text("broken")
    yield lab
    bench.write_text(BENCH)
    lab.session.disconnect_bench()


def said(lab) -> str:
    notice = lab.window.centre.notice
    return notice.text() if notice.isVisible() else ""


def test_a_field_that_is_not_read(gone) -> None:
    gone.session.read_field()
    gone.until(lambda: not gone.session.bench.reading)
    assert said(gone).startswith("The field was not read")


def test_a_monitor_that_is_refused(gone) -> None:
    gone.session.show_monitor(True)
    gone.until(lambda: not gone.session.monitor.alive)
    assert said(gone).startswith("The monitor was refused")


def test_a_record_that_is_not_kept(lab, tmp_path: Path, monkeypatch) -> None:
    session, nowhere = lab.session, tmp_path / "a file"
    nowhere.write_text("no folder")
    session.show_monitor(True)
    lab.until(lambda: session.monitor.sensor.held > 0.3)
    monkeypatch.setattr(session, "out", nowhere)
    lab.window.centre.monitor_bar.record.click()
    lab.until(lambda: said(lab).startswith("Not recorded"))
    assert not session.monitor.recording


def test_a_current_that_a_warm_coil_is_refused(lab) -> None:
    lab.session.manual.hear(Message("warning", "The coil is still warm."))
    assert "still warm" in said(lab)
    lab.run()
    assert not said(lab), "it was of what is over"


def test_a_message_of_many_lines_leaves_the_lanes_their_room(lab) -> None:
    """A study opened as a skin said 15 lines: of the lanes nothing could be read."""
    words = "\n".join(f"mistake {number}" for number in range(15))
    lab.window.centre.say(words)
    assert said(lab).splitlines() == [
        "mistake 0",
        "mistake 1",
        "… 13 more lines in the log.",
    ]
    assert lab.window.centre.notice.toolTip() == words
    lab.window.centre.say("")
