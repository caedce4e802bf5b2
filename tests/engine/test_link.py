"""A plain script at the pipe: no window, no Qt."""

import gc
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import cast

import pytest
from engine_answers import answered, pid_of, size_of

from tactile_lab.acquisition.events import RunState, SpikesSeen
from tactile_lab.engine import engine as module
from tactile_lab.engine.commands import begin_monitor, begin_run, note
from tactile_lab.engine.engine import (
    MOST_QUESTIONS,
    MOST_TASKS,
    Engine,
    Reply,
    ServedTask,
)
from tactile_lab.engine.events import Begun, Ended, Samples
from tactile_lab.engine.jobs import check_bench
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request
from tactile_lab.store.run import Run

SHORT = ('protocol.levels=["200 mN"]', "protocol.hold=0.8 s", "protocol.rest=0.3 s")

SCRIPT = """
import sys
from pathlib import Path
from tactile_lab.engine.commands import begin_run
from tactile_lab.engine.events import Begun, Ended, Samples
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request

if __name__ == "__main__":
    kinds, bins = set(), 0
    with Link(realtime=False) as link:
        run = link.follow(begin_run, Request("demo", %r), Path(sys.argv[1]), {})
        for event in run:
            kinds.add(type(event).__name__)
            if isinstance(event, Samples) and "V_C1" in event.bins:
                bins += event.bins["V_C1"].time.size
    ending = event.ending
    assert {"Begun", "Samples", "TrialEnded", "SpikesSeen", "Ended"} <= kinds, kinds
    assert not any(name.startswith("PySide6") for name in sys.modules)
    print(ending.state, ending.off.verified, ending.spikes, bins)
"""


def test_a_script_drives_a_run_through_a_process_of_its_own(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT % (SHORT,))
    asked = [sys.executable, str(script), str(tmp_path / "runs")]
    done = subprocess.run(asked, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    state, verified, spikes, bins = done.stdout.split()
    (folder,) = (tmp_path / "runs").iterdir()
    with Run.load(folder) as run:
        assert (state, verified) == ("complete", "True")
        assert run.spikes.size == int(spikes) > 5
        assert int(bins) > 1000 * run.duration - 5, "each millisecond was told once"


def test_a_stop_said_before_anything_is_made_ends_the_run_with_the_coil_off(tmp_path):
    with Link(separate=False, realtime=False) as link:
        run = link.follow(begin_run, Request("demo"), tmp_path, {})
        run.stop("at once")
        told = list(run)
    ending = told[-1].ending
    assert ending.state is RunState.ABORTED and ending.reason == "at once"
    assert ending.off.verified and not run.alive


def test_a_stop_waits_for_no_note_that_the_disk_does_not_take(tmp_path):
    """Its file is a pipe here: whoever looks into it waits until somebody writes."""
    longer = ('protocol.levels=["80 mN"]', "protocol.hold=3 s")
    with Link(separate=False) as link:
        run = link.follow(begin_run, Request("demo", longer), tmp_path, {})
        begun = next(iter(run))
        remarks = begun.folder / "remarks.json"
        os.mkfifo(remarks)
        run.say(note, "the disk hangs", None)
        run.stop("before the note is there")
        *_, told = run
        remarks.write_text("{}")
    assert told.ending.state is RunState.ABORTED and told.ending.off.verified


def breaks_when_told(served: ServedTask) -> None:
    """Something of somebody's own to do to a run, with a mistake in it."""
    raise KeyError("nothing")


def test_a_run_does_not_go_on_that_did_not_do_what_it_was_told(tmp_path):
    longer = ('protocol.levels=["80 mN"]', "protocol.hold=3 s")
    with Link(separate=False) as link:
        run = link.follow(begin_run, Request("demo", longer), tmp_path, {})
        next(iter(run))
        run.say(breaks_when_told)
        run.say(note, "is heard all the same", None)
        *_, told = run
    ending = told.ending
    assert ending.state is RunState.ABORTED and ending.off.verified
    assert ending.reason.endswith("broke. KeyError: 'nothing'")
    assert "is heard" in (next(tmp_path.iterdir()) / "remarks.json").read_text()


def test_a_refused_task_only_ends_and_says_why(tmp_path):
    with Link(separate=False, realtime=False) as link:
        strong = Request("demo", ('protocol.levels=["900 mN"]',))
        (told,) = link.follow(begin_run, strong, tmp_path, {})
        (other,) = link.follow(begin_monitor, Request("demo"))
    assert isinstance(told, Ended) and told.ending.state is RunState.REFUSED
    assert "reachable" in told.ending.reason and told.ending.exit_code == 2
    assert "asks for a force" in other.ending.reason
    assert not list(tmp_path.iterdir())


def test_a_monitor_is_told_like_a_run(tmp_path):
    scene = ("sensor.V_GS=1.65 V", "record.sample_rate=0.1 MS/s")
    with Link(separate=False) as link:
        monitor = link.follow(begin_monitor, Request("monitor", scene))
        kinds = set()
        for event in monitor:
            kinds.add(type(event))
            if SpikesSeen in kinds:
                monitor.stop("seen enough")
    assert {Begun, Samples, SpikesSeen, Ended} <= kinds
    assert event.ending.state is RunState.ABORTED


def breaks(engine: Engine) -> None:
    """A question of somebody's own, with a mistake in it."""
    raise KeyError("nothing")


def polled(link: Link, act, *arguments) -> Reply:
    """The reply to a question."""
    replies = []
    link.ask(replies.append, act, *arguments)
    while not replies:
        link.poll()
    return replies[0]


def test_a_question_is_answered_even_where_it_breaks(tmp_path):
    with Link(separate=False, realtime=False) as link:
        found = polled(link, check_bench, Request("demo")).value
        assert [one.role for one in found.found if not one.problem] == ["coil", "scope"]
        assert found.off.verified
        assert "KeyError: 'nothing'" in polled(link, breaks).problem
        gone = polled(link, check_bench, Request("gone.toml"))
        assert gone.value is None and "gone.toml" in gone.problem


def take_instruments(engine: Engine) -> int:
    """Hold what every task needs, as a long run does; how many threads there are."""
    engine.instruments.acquire()
    return threading.active_count()


def let_go(engine: Engine) -> int:
    """Hold it no longer; how many threads there are by now."""
    engine.instruments.release()
    return threading.active_count()


def test_runs_begun_again_and_again_wait_in_few_threads_and_can_be_stopped(tmp_path):
    """An engine was once seen with 6,958 threads: three for each run that waited."""
    with Link(separate=False, realtime=False) as link:
        before = answered(link, take_instruments).value
        runs = [
            link.follow(begin_run, Request("demo"), tmp_path, {}) for _ in range(60)
        ]
        for run in runs[MOST_TASKS:]:
            (told,) = run
            assert told.ending.state is RunState.REFUSED
            assert "have not ended" in told.ending.reason
        for run in runs[:MOST_TASKS]:
            assert run.alive
            run.stop("enough")
            (told,) = run
            assert "had not begun: enough" in told.ending.reason and told.ending.off
        assert answered(link, let_go).value <= before + MOST_TASKS
        assert not list(tmp_path.iterdir()), "what has not begun leaves no folder"


MAY_ANSWER = threading.Event()


def wait(engine: Engine) -> str:
    """Answer when the test says so, or after a minute."""
    MAY_ANSWER.wait(60)
    return "answered"


def test_one_question_too_many_is_refused_and_those_before_it_are_answered():
    MAY_ANSWER.clear()
    replies: list[Reply[str]] = []
    with Link(separate=False, realtime=False) as link:
        for _ in range(MOST_QUESTIONS + 1):
            link.ask(replies.append, wait)
        while not replies:
            link.poll()
            time.sleep(0.001)
        MAY_ANSWER.set()
        assert (
            replies[0].value is None and "wait for their answers" in replies[0].problem
        )
        while len(replies) <= MOST_QUESTIONS:
            link.poll()
            time.sleep(0.001)
        assert {one.value for one in replies[1:]} == {"answered"}
        assert answered(link, pid_of).value, "and there is room again"


def test_an_engine_of_which_nothing_is_asked_ends_and_the_next_question_starts_one():
    lost: list[str] = []
    with Link(lost=lost.append, rest=0.0) as link:
        first = answered(link, pid_of)
        while link.pid is not None:
            link.poll()
        second = answered(link, pid_of)
        end = time.monotonic() + 60
        while Path(f"/proc/{first.value}").exists() and time.monotonic() < end:
            time.sleep(0.001)
        assert not Path(f"/proc/{first.value}").exists(), "it is still there"
    assert not first.lost and not second.lost and lost == []
    assert first.value != second.value


def test_a_question_is_asked_at_once_though_the_engine_does_not_read_it_yet():
    """The window would stand meanwhile, and STOP with it."""
    large, replies = bytes(1 << 20), []
    with Link() as link:
        pid = answered(link, pid_of).value
        os.kill(pid, signal.SIGSTOP)
        while ") T " not in Path(f"/proc/{pid}/stat").read_text():
            time.sleep(0.001)
        asked = threading.Thread(
            target=link.ask, args=(replies.append, size_of, large), daemon=True
        )
        asked.start()
        asked.join(10)
        waits = asked.is_alive()
        os.kill(pid, signal.SIGCONT)
        while not replies:
            link.poll()
            time.sleep(0.001)
    assert replies[0].value == len(large) and not waits


def test_an_engine_gives_back_what_ended_tasks_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Left:
        """Refers to itself, as what a run leaves does."""

        def __init__(self) -> None:
            self.own = self

    monkeypatch.setattr(module, "QUIET", 0.001)
    gc.collect()
    gc.disable()  # of its own accord
    left = weakref.ref(Left())
    ours, theirs = Pipe()
    serving = threading.Thread(target=Engine(theirs, alone=True).serve)
    serving.start()
    end = time.monotonic() + 60
    while left() is not None and time.monotonic() < end:
        time.sleep(0.001)
    gc.enable()
    ours.send(None)
    serving.join(60)
    assert left() is None


class SlowPipe:
    """Whoever is at its other end has gone; what is sent takes a while."""

    def __init__(self) -> None:
        self.begun, self.closed, self.sent = threading.Event(), False, 0

    def recv(self) -> None:
        raise EOFError

    def send(self, what: object) -> None:
        self.begun.set()
        time.sleep(0.05)
        assert not self.closed, "as multiprocessing's own breaks then"
        self.sent += 1

    def close(self) -> None:
        self.closed = True


def test_an_engine_that_ends_lets_an_answer_be_sent_first() -> None:
    """A thread broke on a pipe that was closed under it, as a window closed."""
    pipe = SlowPipe()
    engine = Engine(cast(Connection, pipe))
    telling = threading.Thread(target=engine.tell, args=(1, Reply(None)))
    telling.start()
    assert pipe.begun.wait(5)
    engine.serve()
    telling.join()
    assert pipe.closed and pipe.sent == 1
