"""The window on a virtual screen with a window manager, driven by keys and clicks."""

import contextlib
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from served_source import Source

PROGRAM = Path(__file__).parents[1] / "support" / "window_that_opens.py"
NEEDED = ("Xvfb", "openbox", "xdotool")
pytestmark = pytest.mark.skipif(
    any(shutil.which(tool) is None for tool in NEEDED),
    reason=f"needs {', '.join(NEEDED)} (apt; see .ci/system-packages)",
)


SCENE = """
[protocol]
name = "pulses"
levels = ["120 mN"]
hold = "600 s"

[record]
signals = ["force"]
"""
"""A run that lasts until it is stopped."""

MAIN = ".*Tactile Lab"
"""Title of the window: it names run and bench, too."""

LONGEST = 90.0


@dataclass(frozen=True)
class OnScreen:
    """The program, and what a person can do to it.

    Attributes:
        program: the window's process.
        environment: with the screen it is on.
        runs: folder of its runs.
        main: its main window, as X numbers it.
    """

    program: subprocess.Popen[bytes]
    environment: dict[str, str]
    runs: Path
    main: str = ""

    def tool(self, *arguments: str) -> str:
        """What xdotool says; "" if it finds nothing."""
        done = subprocess.run(
            ["xdotool", *arguments],
            env=self.environment, capture_output=True, text=True, timeout=LONGEST,
        )  # fmt: skip
        return done.stdout.strip()

    def ask(self, word: object) -> dict[str, Any]:
        """Have the program open or shut something; what it tells of it."""
        assert self.program.stdin is not None and self.program.stdout is not None
        self.program.stdin.write(f"{word}\n".encode())
        self.program.stdin.flush()
        told, _, _ = select.select([self.program.stdout], [], [], LONGEST)
        assert told, f"nothing came of {word}"
        answer: dict[str, Any] = json.loads(self.program.stdout.readline())
        return answer

    def named(self, title: str) -> str:
        """The visible window of that title; "" if there is none."""
        return self.tool("search", "--onlyvisible", "--name", f"^{title}$")

    def seen(self) -> int:
        """How many windows, dialogs and menus are visible."""
        pid = str(self.program.pid)
        return len(self.tool("search", "--onlyvisible", "--pid", pid).split())

    def keys(self, *pressed: str) -> None:
        """Press keys in the program's main window."""
        self.tool("windowfocus", self.main, "key", *pressed)

    def press(self, called: str, button: int = 1, *, drag: int = 0) -> None:
        """Press the first of that class, or whose name begins so, or drag it."""
        place = self.ask(f"where {called}")["middles"][0]
        to = ("mousemove", *map(str, place))
        if not drag:
            self.tool(*to, "click", str(button))
            return
        self.tool(*to, "mousedown", str(button))
        self.tool("mousemove_relative", str(drag), str(drag))

    def have_run(self) -> None:
        """Have a run begin, as soon as bench and plan are there, unless one goes on."""
        before = len(list(self.runs.glob("*/run.json")))

        def ready() -> bool:
            state: str = self.ask("state")["state"]
            if state == "fault":  # the computer was too busy for the run before
                self.press("Acknowledge")
            return state == "ready"

        def begun() -> bool:
            self.keys("ctrl+r")
            return len(list(self.runs.glob("*/run.json"))) > before

        if not self.runs_on:
            until(ready, "the bench is not ready")
            until(begun, "no run began")

    @property
    def ended(self) -> tuple[str, str]:
        """How the newest run ended, or that it goes on, and why."""
        newest = max(self.runs.glob("*/run.json"), key=lambda file: file.parent.name)
        run = json.loads(newest.read_text())
        return run["status"], run.get("reason", "")

    @property
    def runs_on(self) -> bool:
        """Whether a run is in progress."""
        return any(self.runs.glob("*/run.json")) and self.ended[0] == "running"


def until(done: Callable[[], object], otherwise: str) -> None:
    """Wait for something; fail where it does not come."""
    end = time.monotonic() + LONGEST
    while not done():
        assert time.monotonic() < end, otherwise
        time.sleep(0.05)


@pytest.fixture
def on_screen(tmp_path: Path, source: Source) -> Iterator[OnScreen]:
    """The window on a screen, its coil source at a port of its own."""
    read, write = os.pipe()
    screen = subprocess.Popen(  # one that resets refuses who comes as the last leaves
        ["Xvfb", "-noreset", "-displayfd", str(write), "-screen", "0", "1366x768x24"],
        pass_fds=(write,), stderr=subprocess.DEVNULL,
    )  # fmt: skip
    started: list[subprocess.Popen[bytes]] = [screen]
    try:
        os.close(write)
        with os.fdopen(read) as told:
            display = f":{told.readline().strip()}"
        environment = {
            **os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb",
            "XDG_CONFIG_HOME": str(tmp_path / "config"),
        }  # fmt: skip
        started.append(
            subprocess.Popen(["openbox"], env=environment, stderr=subprocess.DEVNULL)
        )
        settings = tmp_path / "config" / "tactile-lab" / "Tactile Lab.conf"
        settings.parent.mkdir(parents=True)
        settings.write_text("[preferences]\nreports=false\n")  # each costs a process
        runs, scene = tmp_path / "runs", tmp_path / "slow.toml"
        scene.write_text(SCENE)
        program = subprocess.Popen(
            [
                *(sys.executable, PROGRAM, scene, "--out", runs),
                *("--bench", source.bench),
            ],
            env=environment, cwd=tmp_path,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        started.append(program)
        made = OnScreen(program, environment, runs)
        until(lambda: made.named(MAIN), "no window came")
        yield replace(made, main=made.named(MAIN))
    finally:
        for process in reversed(started):
            while process.poll() is None:
                process.terminate()  # after a fault the window stays, to be read
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(5)
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    pipe.close()


CLICK, KEY, ESCAPE = WAYS = "STOP in the window", "STOP by F12", "STOP by Esc"
TRIES, TOO_BUSY = 3, "The deciding loop gave no sign of life"
"""Why a run ends before STOP on a computer that does too much else: again then."""


@pytest.mark.timeout(900)
def test_stop_acts_whatever_is_open(on_screen: OnScreen, source: Source) -> None:
    """One act on STOP ends the run, with a window, menu or card open, or in a drag.

    All that the window opens is opened here, and STOP is pressed over each that is
    something else to X than those before; `test_stop_whatever_is_open.py` presses it
    over every one. The witness is the source: what it was told, not what the window
    says. In the end the window closes by its key.
    """
    screen = on_screen

    def menu(called: str, button: int) -> Callable[[], None]:
        def opened() -> None:
            alone = screen.seen()
            screen.press(called, button)
            until(lambda: screen.seen() > alone, "no menu came")

        return opened

    def drag(called: str) -> Callable[[], None]:
        return lambda: screen.press(called, drag=40)

    def close() -> None:
        screen.keys("alt+F4")
        until(lambda: screen.ask("state")["open"], "no question on closing came")

    def ask_from_field() -> list[str]:
        screen.press("Note")
        screen.tool("key", "ctrl+e")  # which a field on X11 takes for its line's end
        opened: list[str] = ["QFileDialog"]
        until(lambda: screen.ask("state")["open"] == opened, "no file was asked for")
        return opened

    def stops(name: str, opens: Callable[[], object], reason: str) -> None:
        """Press STOP, unless it was pressed over the like of it."""
        case = f"{reason} with {name} open"
        for _ in range(TRIES):
            screen.have_run()
            until(
                lambda: source.output or not screen.runs_on, "the output never came on"
            )
            opened = opens()
            assert opened != [], f"{name}: nothing was opened"
            if opened in known:
                screen.ask("shut")
                return
            if reason == CLICK:
                screen.press("StopButton")
            else:
                screen.tool("key", "F12" if reason == KEY else "Escape")
            until(lambda: not screen.runs_on, f"{case}: the run goes on")
            screen.tool("mouseup", "1")
            screen.ask("shut")
            if not screen.ended[1].startswith(TOO_BUSY):
                break
        assert screen.ended == ("aborted", reason), case
        assert not source.output, f"{case}: the source was told nothing"
        if opened is not None:
            known.append(opened)

    known: list[object] = []
    stops("nothing", lambda: None, ESCAPE)
    stops("the protocols", menu("Picker", 1), CLICK)
    stops("a field's menu", menu("Note", 3), CLICK)
    stops("a drag of the lanes", drag("Lanes"), KEY)
    stops("a drag of a border", drag("QSplitterHandle"), ESCAPE)
    stops("the question on closing", close, CLICK)
    stops("a file asked for from a field", ask_from_field, KEY)
    for place, name in enumerate(screen.ask("names")["names"]):
        way = WAYS[len(known) % 3]
        stops(name, lambda place=place: screen.ask(place)["open"], way)
    screen.keys("Escape")  # the last run may go on
    until(lambda: not screen.runs_on, "the last run goes on")
    # its record is complete before the window hears so, which would ask
    until(lambda: screen.ask("state")["state"] == "ready", "the last run goes on")
    screen.keys("alt+F4")
    assert screen.program.wait(LONGEST) == 0
