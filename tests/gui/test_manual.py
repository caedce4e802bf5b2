"""The bench by hand: scope inputs between runs, the field on request."""

from gui.state import State


def test_inputs_are_set_for_all_that_follows(lab) -> None:
    window, session = lab.window, lab.session
    inputs = window.review.manual.inputs
    card = next(c for c in inputs.cards if c.table()["signal"] == "V_C1")
    card.range.setCurrentIndex(card.range.findData(5.0))
    card.offset.setText("0 V")
    card.coupling.setCurrentText("AC")
    inputs.use.click()
    assert inputs.problem == ""
    channel = next(c for c in session.spec.scope.channels if c.signal == "V_C1")
    assert (channel.range, channel.offset, channel.coupling) == (5.0, 0.0, "AC")
    scene = window.setup.request().load()
    planned = next(c for c in scene.bench.scope.channels if c.signal == "V_C1")
    assert planned == channel, "the next run has them, and so has its command line"
    session.connect_bench("sim")
    lab.until(lambda: session.state is State.READY)
    assert session.bench_overrides == (), "another bench has its own"


def test_unusable_inputs_change_nothing_and_say_why(lab) -> None:
    window, session = lab.window, lab.session
    inputs, before = window.review.manual.inputs, session.spec
    inputs.cards[0].offset.setText("some volts")
    inputs.use.click()
    assert "some volts" in inputs.problem
    inputs.cards[0].offset.setText("-2.5 V")
    inputs.cards[0].range.addItem("3 V", 3.0)
    inputs.cards[0].range.setCurrentIndex(inputs.cards[0].range.findData(3.0))
    inputs.use.click()
    assert "3 V" in inputs.problem and "none of the scope's" in inputs.problem
    assert session.spec is before and session.bench_overrides == ()


def test_inputs_are_locked_while_running(lab) -> None:
    window, session = lab.window, lab.session
    session._enter(State.RUNNING)
    inputs = window.review.manual.inputs
    assert not inputs.use.isEnabled() and not inputs.cards[0].isEnabled()
    assert session.set_inputs("[]") != ""
    session._enter(State.READY)
    assert inputs.use.isEnabled()


def test_field_is_read_on_request(lab) -> None:
    window, session = lab.window, lab.session
    session.readings.clear()
    window.review.manual.read.click()
    assert not window.review.manual.read.isEnabled(), "one reading at a time"
    lab.until(lambda: not session.reading_field)
    assert "field" in session.readings
    assert window.review.manual.read.isEnabled()


def test_a_coil_that_comes_too_late_is_not_taken(lab) -> None:
    session = lab.session
    session.begin_manual()
    assert session.manual is None, "the bench is opened beside the window's thread"
    session._enter(State.RUNNING)
    lab.until(lambda: not session.taking)
    assert session.manual is None
    session._enter(State.READY)
