"""How soon an engine is there, and answers who is on a bench."""

import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from engine_answers import answered, pid_of

from tactile_lab.bench import Bench, Meter
from tactile_lab.clock import RealClock
from tactile_lab.engine import process
from tactile_lab.engine.engine import Engine
from tactile_lab.engine.jobs import check
from tactile_lab.engine.link import Link
from tactile_lab.engine.memory import forget_code
from tactile_lab.scope import Scope

forks = pytest.mark.skipif(not process.FORKS, reason="engines are forked on Linux only")


def parent_of(engine: Engine) -> int:
    return os.getppid()


def niceness(engine: Engine) -> int:
    return os.nice(0)


def word(engine: Engine) -> str | None:
    return os.environ.get("A_WORD")


def loaded(engine: Engine) -> bool:
    runs = {"tactile_lab.engine.execution", "tactile_lab.store.stored_run"}
    return runs | {"sim_backend.bench"} <= sys.modules.keys()


@forks
def test_an_engine_has_what_it_needs_and_the_next_shares_it():
    with Link() as one, Link(behind=True) as other:
        assert answered(one, loaded).value
        first, behind = (answered(link, niceness).value for link in (one, other))
        # before others only where it is allowed
        assert first in (process.FIRST, os.nice(0)) and behind == process.BEHIND
        parents = {answered(link, parent_of).value for link in (one, other)}
        assert len(parents) == 1 and os.getpid() not in parents
        assert answered(one, pid_of).value != answered(other, pid_of).value


@forks
def test_an_engine_is_asked_in_the_environment_of_who_asks(monkeypatch):
    """What engines are forked from may be older than a variable."""
    with Link() as link:
        assert answered(link, word).value is None
    monkeypatch.setenv("A_WORD", "said later")
    with Link() as link:
        assert answered(link, word).value == "said later"


def resident(pid: int | str | None, library: str, kind: str = "Rss") -> int:
    """Memory of a kind in a process's libraries of that name, kB."""
    maps = Path(f"/proc/{pid}/smaps").read_text()
    sizes = re.findall(rf"{library}.*\n(?:(?!{kind}).*\n)+{kind}: +(\d+)", maps)
    assert sizes
    return sum(map(int, sizes))


@forks
def test_what_engines_are_forked_from_keeps_no_code_that_it_will_not_run():
    """Of the compiler, used once to load what it had compiled, 70 MB stayed."""
    with Link() as link:
        assert resident(answered(link, parent_of).value, "libllvmlite") < 30_000


@forks
def test_only_what_is_in_a_library_as_in_its_file_is_forgotten():
    """What was written into it as it was loaded, such as addresses, cannot be read."""
    libraries = "self", r"[.]so"
    written = resident(*libraries, "Anonymous")
    whole = resident(*libraries)
    forget_code()
    assert resident(*libraries, "Anonymous") >= written
    assert resident(*libraries) < whole
    assert np.linalg.eigvalsh(np.eye(3)).tolist() == [1, 1, 1]


HOLES = """
import re, sys
from pathlib import Path
import numpy as np
from tactile_lab.engine import memory

def heap():
    maps = Path("/proc/self/maps").read_text()
    low, high = re.findall(r"(\\w+)-(\\w+) .*[[]heap[]]", maps)[0]
    return int(high, 16) - int(low, 16)

memory.share_heap()
if "map" in sys.argv:
    memory.map_large()
del (first := [np.ones(1 << 20)])[:]  # from now on glibc keeps so much in its heap
before, kept = heap(), []
large = [(np.ones(1 << 18), kept.append(bytes(1000 + n))) for n in range(20)]
print(heap() - before)
"""


@forks
def test_what_is_large_leaves_no_holes_in_the_heap():
    """The window grew by 10 MB in 16 runs."""
    kept, mapped = (
        int(subprocess.check_output([sys.executable, "-c", HOLES, word], timeout=120))
        for word in ("keep", "map")
    )
    assert kept > 30e6 > 5e6 > mapped


def test_an_engine_that_cannot_be_started_is_lost(monkeypatch):
    def refuse(self: object) -> None:
        raise OSError("no more processes")

    monkeypatch.setattr(process.CONTEXT.Process, "start", refuse)
    lost: list[str] = []
    with Link(lost=lost.append) as link:
        reply = answered(link, pid_of)
    assert reply.lost and reply.value is None
    assert lost == ["The pipe to it ended"]


class Met:
    """An instrument that answers once another is asked, too."""

    def __init__(self, both: threading.Barrier) -> None:
        self._both = both

    def open(self) -> None:
        self._both.wait(60)

    def close(self) -> None:
        pass

    identity = "met"


def test_the_instruments_of_a_bench_are_asked_at_once():
    """They were asked one after the other: READY came 0.7 s later."""
    both = threading.Barrier(2)
    bench = Bench(
        name="two", simulated=False, clock=RealClock(),
        scope=cast("Scope", Met(both)), field_meter=cast("Meter", Met(both)),
    )  # fmt: skip
    found = check(bench)
    assert found.sound and [one.identity for one in found.found] == ["met", "met"]
