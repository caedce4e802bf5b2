from dataclasses import replace

import pytest

from gui.look.theme import Theme
from gui.record.progress import ProgressStrip
from gui.state import (
    HOLDS,
    STALE,
    CoilKnowledge,
    CoilView,
    Snapshot,
    WindowState,
    clock_text,
    milliamperes,
    minutes,
    run_problem,
    stop_text,
    truth,
)

LIVE = CoilView(True, 0.374, 0.374, limit=2.0)


def test_stop_tells_the_read_back_not_the_command() -> None:
    coil = CoilView(True, current=0.112, setpoint=0.9, under=0.9)
    assert stop_text(WindowState.RUNNING, coil).detail == "112 mA live"


def test_silent_source_is_unknown() -> None:
    silent = CoilView(True, 0.374, 0.374, age=STALE + 0.1)
    assert truth(WindowState.RUNNING, silent) is CoilKnowledge.UNKNOWN
    assert stop_text(WindowState.RUNNING, silent).title == "COIL STATE UNKNOWN"


def test_old_read_back_is_said_to_be_old() -> None:
    coil = CoilView(True, 0.1, 0.5, age=0.1, read_age=STALE + 1)
    assert stop_text(WindowState.RUNNING, coil).detail == "500 mA sent, not read back"


def test_read_back_of_another_set_point_is_not_called_live() -> None:
    # a ramp is read back once a second; what flowed before it says nothing of now
    coil = CoilView(True, 0.0, 0.6, age=0.01, read_age=0.6, under=0.0)
    assert stop_text(WindowState.RUNNING, coil).detail == "600 mA sent, not read back"
    resting = CoilView(True, 0.598, 0.6, age=0.6, read_age=0.6, under=0.6)
    assert stop_text(WindowState.RUNNING, resting).detail == "598 mA live"


@pytest.mark.parametrize("state", list(WindowState))
def test_unverified_off_is_unknown_in_every_state(state: WindowState) -> None:
    coil = CoilView(False, None, verified_off=False)
    assert truth(state, coil) is CoilKnowledge.UNKNOWN


def test_a_verified_off_holds_for_two_minutes() -> None:
    """It said "coil is off" for ever where nobody asks: no bench, an open fault."""
    off = CoilView(False, 0.0, 0.0, verified_off=True, read_age=HOLDS - 1)
    for state in WindowState.DISCONNECTED, WindowState.FAULT:
        assert truth(state, off) is CoilKnowledge.OFF
        old = replace(off, read_age=300.0)
        assert truth(state, old) is CoilKnowledge.WAS_OFF
        assert stop_text(state, old).spoken == "STOP: 0 mA read back 5 min ago"
    for coil, said in (off, "coil off"), (old, "STOP reads it back"):
        assert clock_text(Snapshot(WindowState.READY, coil=coil))[1] == said
    ran = Snapshot(WindowState.READY, coil=old, elapsed=18.0)
    assert clock_text(ran)[1] == "STOP reads it back", "what to do, and not only then"


def test_without_coil_stop_says_so() -> None:
    assert stop_text(WindowState.DISCONNECTED, None).detail == "no coil source"


def test_live_coil_is_live_also_when_ready() -> None:
    # by hand: the state is ready, the coil is not off
    assert truth(WindowState.READY, LIVE) is CoilKnowledge.LIVE


def test_aborting_shows_the_fall() -> None:
    assert stop_text(WindowState.ABORTING, LIVE).detail == "374 mA → 0"


@pytest.mark.parametrize(
    "state", [s for s in WindowState if s is not WindowState.READY]
)
def test_run_is_off_with_a_reason_unless_ready(state: WindowState) -> None:
    assert run_problem(Snapshot(state=state), form_problem="")


def test_run_is_on_when_ready_and_the_form_is_good() -> None:
    ready = Snapshot(state=WindowState.READY)
    assert run_problem(ready, form_problem="") == ""
    assert run_problem(ready, form_problem="Hold: wrong") == "Hold: wrong"
    assert "by hand" in run_problem(
        Snapshot(state=WindowState.READY, manual=True), form_problem=""
    )


def test_numbers_have_a_true_minus_and_no_negative_zero() -> None:
    assert milliamperes(-0.25) == "−250 mA"
    assert milliamperes(-0.0001) == "0 mA"
    assert milliamperes(None) == "not read"


def test_durations() -> None:
    assert minutes(41) == "00:41"
    assert minutes(59.6) == "01:00"
    assert minutes(3725) == "1:02:05"
    assert minutes(23.44, tenths=True) == "00:23.4"


def test_clock_shows_elapsed_and_expected() -> None:
    running = Snapshot(state=WindowState.RUNNING, elapsed=23.4, expected=41.0)
    assert clock_text(running) == ("RUNNING", "00:23.4 / 00:41")
    fault = replace(running, state=WindowState.FAULT)
    assert "23.4" not in clock_text(fault)[1], "it may have come since that run"


def test_a_run_that_is_stopped_has_no_time_left(app) -> None:
    """It was done at a time that moved on, for as long as the source was silent."""
    strip = ProgressStrip(Theme("light"))
    snapshot = Snapshot(state=WindowState.ABORTING)
    strip.show_run(snapshot, [], 22.0, 5.0, (0, "80 mN"), "")
    assert "Stopping" in strip.text and "remaining" not in strip.text
    assert "00:05" in strip.text


@pytest.mark.parametrize(
    ("ending", "colour"),
    [("Complete", "green"), ("Aborted", "amber"), ("Faulted", "red"), ("", "accent")],
)
def test_a_run_that_is_over_has_the_colour_of_its_end(app, ending, colour) -> None:
    """Once acknowledged, a fault's steps were blue, as those of a run in progress."""
    strip = ProgressStrip(Theme("light"))
    snapshot = Snapshot(state=WindowState.READY)
    told = f"{ending} · some run" if ending else ""
    strip.show_run(snapshot, [], 1.0, 1.0, None, told)
    assert strip.blocks._colour == colour
    assert ("1.0 s kept" in strip.text) is bool(ending)


@pytest.mark.parametrize("ending", ["Cut short", "Broke"])
def test_of_a_run_that_was_cut_it_is_not_said_how_much_was_kept(app, ending) -> None:
    """What was seen live is not all on disk: up to 0.2 s more."""
    strip = ProgressStrip(Theme("light"))
    snapshot = Snapshot(state=WindowState.READY)
    strip.show_run(snapshot, [], 1.0, 1.0, None, f"{ending} · some run")
    assert "1.0 s seen" in strip.text and "kept" not in strip.text
