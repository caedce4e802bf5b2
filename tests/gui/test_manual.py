"""The bench by hand: scope inputs between runs, the field on request."""

import pytest
from PySide6.QtTest import QTest

from gui.state import STALE, CoilKnowledge, CoilView, Snapshot, WindowState, truth
from tactile_lab.acquisition.ending import CoilState, Ending
from tactile_lab.acquisition.events import CoilCurrent, Message, RunState
from tactile_lab.bench import OffReport
from tactile_lab.engine.commands import renew
from tactile_lab.engine.engine import Engine
from tactile_lab.engine.events import Ended, Samples
from tactile_lab.engine.link import RemoteTask


def test_inputs_are_set_for_all_that_follows(lab) -> None:
    window, session = lab.window, lab.session
    inputs = window.review.manual.inputs
    card = next(c for c in inputs.cards if c.table()["signal"] == "V_C1")
    card.range.setCurrentIndex(card.range.findData(5.0))
    card.offset.setText("0 V")
    card.coupling.setCurrentText("AC")
    inputs.use.click()
    assert inputs.problem.text() == ""
    channel = next(c for c in session.bench.spec.scope.channels if c.signal == "V_C1")
    assert (channel.range, channel.offset, channel.coupling) == (5.0, 0.0, "AC")
    scene = window.setup.request().load()
    planned = next(c for c in scene.bench.scope.channels if c.signal == "V_C1")
    assert planned == channel, "the next run has them, and so has its command line"
    session.connect_bench("sim")
    lab.until(lambda: session.state is WindowState.READY)
    assert session.bench.overrides == (), "another bench has its own"


def test_unusable_inputs_change_nothing_and_say_why(lab) -> None:
    window, session = lab.window, lab.session
    inputs, before = window.review.manual.inputs, session.bench.spec
    inputs.cards[0].offset.setText("some volts")
    inputs.use.click()
    assert "some volts" in inputs.problem.text()
    inputs.cards[0].offset.setText("-2.5 V")
    inputs.cards[0].range.addItem("3 V", 3.0)
    inputs.cards[0].range.setCurrentIndex(inputs.cards[0].range.findData(3.0))
    inputs.use.click()
    assert (
        "3 V" in inputs.problem.text()
        and "none of the scope's" in inputs.problem.text()
    )
    assert session.bench.spec is before and session.bench.overrides == ()


def test_inputs_are_locked_while_running(lab) -> None:
    window, session = lab.window, lab.session
    session.status.enter(WindowState.RUNNING)
    inputs = window.review.manual.inputs
    assert not inputs.use.isEnabled() and not inputs.cards[0].isEnabled()
    assert session.set_inputs("[]") != ""
    session.status.enter(WindowState.READY)
    assert inputs.use.isEnabled()


def test_field_is_read_on_request(lab) -> None:
    window, session = lab.window, lab.session
    session.bench.field = None
    window.review.manual.read.click()
    assert not window.review.manual.read.isEnabled(), "one reading at a time"
    lab.until(lambda: not session.bench.reading)
    assert session.bench.field is not None
    assert window.review.manual.read.isEnabled()
    session.bench.check()
    assert session.bench.field is None, "that was before"


def test_a_current_that_is_set_while_the_source_opens_is_not_lost(lab) -> None:
    session = lab.session
    session.begin_manual()
    lab.window.render_state()
    assert "opening" in lab.window.review.manual.force.text()
    session.manual.hold(0.05)
    lab.until(lambda: abs((session.coil_view().current or 0.0) - 0.05) < 2e-3)
    lab.window.render_state()
    assert "read back" in lab.window.review.manual.force.text()
    session.stop("test is over")
    lab.until(lambda: not session.manual.alive)
    assert session.state is WindowState.READY and session.coil_view().verified_off


def test_stop_counts_while_the_source_opens(lab) -> None:
    session = lab.session
    session.begin_manual()
    session.stop("at once")
    session.manual.hold(0.1)
    lab.until(lambda: not session.manual.alive)
    view = session.coil_view()
    assert session.state is WindowState.READY
    assert view.output is False and view.verified_off and abs(view.current) < 2e-3


def test_the_window_answers_each_word_of_the_coil_with_its_lease(lab) -> None:
    session = lab.session
    said: list[object] = []
    session.manual.task = RemoteTask(0, lambda *what: said.append(what))
    state = CoilState(live=True, setpoint=0.1, measured=0.1, off=None)
    for time in range(3):
        session.manual.take(CoilCurrent(float(time), 0.1, 0.1))
        session.manual.take(Samples({}, state))
    assert said == [(Engine.say, renew)] * 3
    assert session.coil_view().current == 0.1
    off = OffReport(False, None, "nobody knows")
    why = "The coil's thread ended without a word."
    session.manual.take(Ended(Ending(RunState.FAULTED, off, why)))
    assert not session.manual.alive
    assert truth(session.state, session.coil_view()) is CoilKnowledge.UNKNOWN
    assert (
        session.state is WindowState.FAULT
        and "without a word" in session.status.fault.consequence
    )
    session.acknowledge()
    session.connect_bench("sim")


def test_the_entry_follows_the_coil_unless_somebody_types(lab) -> None:
    session, panel = lab.session, lab.window.review.manual
    session.begin_manual()
    session.manual.hold(0.2)
    lab.window.render_state()
    assert panel.current.text() == "200 mA" and panel.slider.value() == 10
    panel.current.clear()
    QTest.keyClicks(panel.current, "300 mA")
    lab.window.render_state()
    assert panel.current.text() == "300 mA", "what is being typed stays"
    panel.set.click()
    lab.until(lambda: abs((session.coil_view().current or 0.0) - 0.3) < 2e-3)
    assert panel.current.text() == "300 mA" and panel.slider.value() == 15
    panel.slider.setSliderDown(True)
    panel.slider.setSliderPosition(20)
    panel.slider.setSliderDown(False)
    lab.window.render_state()
    assert panel.current.text() == "400 mA", "chosen, not yet set"
    session.stop("test is over")
    lab.until(lambda: not session.manual.alive)
    lab.window.render_state()
    assert panel.current.text() == "0 mA", "nothing is asked of a coil that is off"


def test_a_field_is_read_while_the_coil_is_held(lab) -> None:
    session = lab.session
    session.bench.field = None
    session.begin_manual()
    session.manual.hold(0.5)
    lab.until(lambda: abs((session.coil_view().current or 0.0) - 0.5) < 2e-3)
    session.read_field()
    lab.until(lambda: not session.bench.reading)
    assert abs(session.bench.field - 5.5e-3) < 1e-4, "11 mT/A, of that coil"
    session.stop("test is over")
    lab.until(lambda: not session.manual.alive)


def test_manual_control_shows_live_and_stop_ends_it(lab) -> None:
    window, session = lab.window, lab.session
    session.begin_manual()
    lab.until(lambda: session.manual.coil is not None)
    window.review.manual.current.setText("5 A")
    window.review.manual.set.click()
    assert session.coil_view().output is not True, "beyond the limit nothing is sent"
    window.review.manual.current.setText("100 mA")
    window.review.manual.set.click()
    lab.until(lambda: abs((session.coil_view().current or 0) - 0.1) < 2e-3)
    lab.until(lambda: window.header.stop.truth is CoilKnowledge.LIVE)
    assert not window.setup.run.isEnabled()
    session.run.expected = 10.0  # of the run before
    assert not window.close(), "the coil is live: closing asks"
    assert "100 mA" in window.closing.now.text()
    assert "remaining" not in window.closing.now.text(), "that was the run's"
    window.closing.keep.click()
    window.review.manual.current.setText("5 A")
    window.review.manual.set.click()
    window.header.stop.click()
    lab.until(lambda: not session.manual.alive)
    assert session.coil_view().verified_off
    window.render_state()
    assert not window.review.manual._problem.text(), "said of an entry that is gone"


def test_the_lanes_show_the_coil_while_it_is_driven_by_hand(lab) -> None:
    session, window = lab.session, lab.window
    results = window.screen_.results
    results.folder = lab.folder / "an earlier run"
    session.begin_manual()
    lab.until(lambda: session.manual.opened)
    session.manual.hold(0.1)
    lab.until(lambda: (c := session.coil_view()) is not None and c.current == 0.1)
    source = session.manual.source
    lab.until(lambda: source.reach > 0 and source.mean("coil_current") == 0.1)
    assert window.centre.stack.source is source and source.running
    keys = [row.lane.key for row in window.centre.stack.rows]
    assert keys == ["force", "coil_current"]
    gain = session.bench.spec.magnet.newtons_per_ampere
    assert source.mean("force") == pytest.approx(0.1 * gain)
    progress = window.centre.progress
    lab.until(lambda: "By hand" in progress.text)
    assert "kept" not in progress.text.partition("|")[2], "nothing is"
    assert results.folder is None, "nor are there results of a run beside it"
    session.stop("enough")
    lab.until(lambda: not session.manual.alive)
    assert not source.running
    lab.complete_run()
    assert session.source is session.run.source, "the next run takes the lanes"


def test_a_current_that_a_warm_coil_is_refused_is_told(lab) -> None:
    manual = lab.session.manual
    manual.hear(Message("warning", "The coil is still warm: 1 A may flow in 90 s."))
    assert "still warm" in lab.session.log.lines[-1].text


def test_no_current_is_claimed_of_a_source_that_is_silent(lab) -> None:
    view = lab.window.review.manual
    silent = CoilView(True, 0.3, 0.3, age=STALE + 1, read_age=STALE + 1)
    view.render_snapshot(Snapshot(WindowState.READY, coil=silent, manual=True), None)
    assert view.now.text() == "—" and "unknown" in view.force.text()
