"""Progress, warnings, and errors as one message with a code."""

import io
import re
import signal
from contextlib import suppress

import click
import pytest

from tactile_lab.commands.terminal import (
    ProgressLine,
    print_json,
    progress,
    refusing,
    say,
)
from tactile_lab.errors import SceneError


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture(autouse=True)
def _a_terminal_that_can_redraw(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")


class Watch:
    def __init__(self):
        self.time = 0.0

    def __call__(self):
        return self.time


def test_piped_progress_is_a_plain_line_per_tenth():
    stream, watch = io.StringIO(), Watch()
    with ProgressLine(100.0, "demo", stream, watch) as progress:
        for done in range(1001):
            watch.time = done / 100
            progress.update(done / 10)
    lines = stream.getvalue().splitlines()
    assert len(lines) == 11
    assert "\r" not in stream.getvalue()
    assert "50%" in lines[5]
    assert "5 s left" in lines[5]


def test_progress_on_a_terminal_redraws_one_line_with_the_time_left():
    stream, watch = Terminal(), Watch()
    with ProgressLine(10.0, "demo", stream, watch) as progress:
        progress.update(0.0)
        watch.time = 30.0
        progress.update(5.0, "120 mN")
        shown = stream.getvalue()
        assert "30 s left" in shown
        assert "120 mN" in shown
        assert "\n" not in shown
    assert stream.getvalue().endswith("\x1b[2K"), "the line is wiped"


def test_what_happens_once_before_the_first_update_is_not_taken_for_the_pace():
    stream, watch = io.StringIO(), Watch()
    progress = ProgressLine(10.0, "demo", stream, watch)
    watch.time = 13.0
    progress.update(0.1)
    watch.time = 14.0
    progress.update(5.05)
    first, second = stream.getvalue().splitlines()
    assert "left" not in first
    assert "1 s left" in second


def test_redraws_are_few():
    stream, watch = Terminal(), Watch()
    progress = ProgressLine(1.0, "demo", stream, watch)
    for step in range(1000):
        watch.time += 1e-3
        progress.update(step / 1000)
    assert stream.getvalue().count("\r") <= 12


def test_notes_stand_on_their_own_lines():
    stream = Terminal()
    progress = ProgressLine(1.0, "demo", stream, Watch())
    progress.update(0.5)
    progress.note("warning: something")
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())
    lines = plain.split("\n")
    assert any(line.split("\r")[-1] == "warning: something" for line in lines)


def test_progress_of_nothing_and_beyond_the_end():
    stream = io.StringIO()
    ProgressLine(0.0, "demo", stream, Watch()).update(0.0)
    ProgressLine(1.0, "demo", stream, Watch()).update(2.0)
    assert stream.getvalue().count("100%") == 2


def test_our_errors_become_one_message_and_code_2(capsys):
    with pytest.raises(click.exceptions.Exit) as end, refusing():
        raise SceneError("no such thing")
    assert end.value.exit_code == 2
    assert capsys.readouterr().err == "tactile-lab: no such thing\n"


def test_other_errors_are_bugs_and_keep_their_trace():
    with pytest.raises(ZeroDivisionError), refusing():
        _ = 1 / 0


def test_a_note_cannot_act_on_the_terminal(capsys):
    say("by \x1b]0;x\x07Eve\x9b2J\tand\nme µ")
    assert capsys.readouterr().out == "by \\x1b]0;x\\x07Eve\\x9b2J\tand\nme µ\n"


def test_json_refuses_nan():
    with pytest.raises(ValueError, match="JSON"):
        print_json({"x": float("nan")})


def test_json_keeps_full_precision(capsys):
    print_json({"x": 0.1 + 0.2})
    assert capsys.readouterr().out == '{"x": 0.30000000000000004}\n'


def test_colour_is_for_terminals_and_not_where_it_is_unwanted(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    terminal, pipe, unwanted = Terminal(), io.StringIO(), Terminal()
    say("V_C1: WRONG", terminal)
    say("V_C1: WRONG", pipe)
    monkeypatch.setenv("NO_COLOR", "1")
    say("V_C1: WRONG", unwanted)
    assert "\x1b[1;31mWRONG" in terminal.getvalue()
    assert pipe.getvalue() == "V_C1: WRONG\n"
    assert "31m" not in unwanted.getvalue()


@pytest.fixture
def _ctrl_c_as_python_has_it():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("_ctrl_c_as_python_has_it")
def test_a_ctrl_c_that_was_swallowed_ends_the_work_at_its_next_update():
    reached = []
    with pytest.raises(KeyboardInterrupt), progress("writing") as update:
        with suppress(KeyboardInterrupt):  # as in a callback from C
            signal.raise_signal(signal.SIGINT)
        reached.append("went on")
        update(0.5)
        reached.append("beyond the update")
    assert reached == ["went on"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
