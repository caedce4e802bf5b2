"""The window on a virtual screen with a window manager, driven by keys and clicks."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from served_source import Source

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

HEADER = 34
"""Height at which the header's buttons are, px."""


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

    def named(self, title: str) -> str:
        """The visible window of that title; "" if there is none."""
        return self.tool("search", "--onlyvisible", "--name", f"^{title}$")

    def seen(self) -> int:
        """How many windows, dialogs and menus are visible."""
        pid = str(self.program.pid)
        return len(self.tool("search", "--onlyvisible", "--pid", pid).split())

    def keys(self, *pressed: str) -> None:
        """Press keys in the program's main window."""
        self.tool("windowactivate", "--sync", self.main, "key", *pressed)

    def at(self, from_right: int, down: int) -> tuple[str, ...]:
        """How the pointer gets to a place so many px from the upper right corner.

        Not with --sync: where the pointer is there already, that waits for 16 s. X
        keeps the order of what it is asked for, so that a click that follows hits.
        """
        said = self.tool("getwindowgeometry", "--shell", self.main).split()
        width = dict(line.split("=") for line in said)["WIDTH"]
        place = str(int(width) - from_right), str(down)
        return ("mousemove", "--window", self.main, *place)

    def click(self, from_right: int, down: int = HEADER, button: int = 1) -> None:
        """Click there, into the header unless told."""
        self.tool(*self.at(from_right, down), "click", str(button))

    def begin_run(self) -> None:
        """Have a run begin, as soon as bench and plan are there."""
        before = len(list(self.runs.glob("*/run.json")))

        def begun() -> bool:
            self.keys("ctrl+r")
            return len(list(self.runs.glob("*/run.json"))) > before

        until(begun, "no run began")

    def shut(self, title: str) -> bool:
        """Press Esc in the windows of that title; whether there is none left.

        While a run is still being ended, Esc is STOP there, too.
        """
        for window in self.named(title).split():
            self.tool("windowfocus", window, "key", "Escape")
        return not self.named(title)

    def ended(self) -> list[tuple[str, str]]:
        """How each run ended, or that it goes on, and why, oldest first."""
        files = sorted(self.runs.glob("*/run.json"))
        runs = (json.loads(file.read_text()) for file in files)
        return [(run["status"], run.get("reason", "")) for run in runs]


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
        ["Xvfb", "-noreset", "-displayfd", str(write), "-screen", "0", "1280x800x24"],
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
                *(sys.executable, "-m", "tactile_lab", "gui", scene, "--out", runs),
                *("--bench", source.bench),
            ],
            env=environment, cwd=tmp_path,
        )  # fmt: skip
        started.append(program)
        made = OnScreen(program, environment, runs)
        until(lambda: made.named(MAIN), "no window came")
        yield replace(made, main=made.named(MAIN))
    finally:
        for process in reversed(started):
            if process.poll() is None:
                process.terminate()
                process.wait(LONGEST)


STOP, MENU = 130, 440
"""Where they are in the header, px from the right."""

LAYERS, STAR = (108, 101), (1072, 101)
"""Buttons that open menus, px from the right and from the top."""

NOTE, PROTOCOL = (170, 678), (1100, 143)
"""The field for notes, which has a context menu, and the list of protocols."""

LANES, SPLITTER = (500, 300), (949, 400)
"""Where a drag moves the lanes, and where it moves a side panel's border."""

EXPORT, REPLACE = "Export this view", "Replace the file."


@pytest.mark.timeout(900)
def test_stop_acts_whatever_is_open(on_screen: OnScreen, source: Source) -> None:
    """One act on STOP ends the run, with a dialog, its question or a menu open.

    The witness is the source: what it was told, not what the window says. In the end
    the window closes by its key.
    """
    screen = on_screen

    def nothing() -> None:
        pass

    def dialog(keys: str, title: str) -> Callable[[], None]:
        def opened() -> None:
            screen.keys(keys)
            until(lambda: screen.named(title), f"no dialog came: {title}")

        opened.__name__ = title
        return opened

    def card(keys: str) -> Callable[[], None]:
        def opened() -> None:
            screen.keys(keys)

        opened.__name__ = f"card of {keys}"
        return opened

    def menu(at: tuple[int, int], button: int = 1) -> Callable[[], None]:
        def opened() -> None:
            alone = screen.seen()
            screen.click(*at, button)
            until(lambda: screen.seen() > alone, f"no menu came at {at}")

        opened.__name__ = f"menu at {at}"
        return opened

    def drag(at: tuple[int, int]) -> Callable[[], None]:
        def begun() -> None:
            screen.tool(*screen.at(*at), "mousedown", "1")
            screen.tool(*screen.at(at[0] + 60, at[1] + 20))

        begun.__name__ = f"drag at {at}"
        return begun

    export = dialog("ctrl+e", EXPORT)

    def replace_file() -> None:
        export()
        # a file of that name is there already
        screen.tool("windowactivate", "--sync", screen.named(EXPORT), "key", "Return")
        until(lambda: screen.named(REPLACE), "no question came")

    (screen.runs.parent / "view.png").touch()
    click, key, escape = "STOP in the window", "STOP by F12", "STOP by Esc"
    gear = (MENU, HEADER)
    cases: tuple[tuple[Callable[[], None], str, tuple[str, ...]], ...] = (
        (nothing, escape, ()),
        (export, click, (EXPORT,)),
        (export, key, (EXPORT,)),
        (export, escape, (EXPORT,)),
        (replace_file, click, (REPLACE, EXPORT)),
        (replace_file, key, (REPLACE, EXPORT)),
        (menu(gear), click, ()),
        (menu(gear), escape, ()),
        (menu(LAYERS), click, ()),
        (menu(STAR), click, ()),
        (menu(PROTOCOL), click, ()),
        (menu(NOTE, button=3), click, ()),
        (menu(LANES, button=3), click, ()),
        (drag(LANES), key, ()),
        (drag(SPLITTER), escape, ()),
        (dialog("ctrl+o", "Open a scene"), click, ("Open a scene",)),
        (dialog("ctrl+shift+o", "Open a run"), click, ("Open a run",)),
        (dialog("ctrl+s", "Save the scene"), key, ("Save the scene",)),
        (card("ctrl+k"), click, ()),
        (card("F1"), escape, ()),
        (card("ctrl+comma"), key, ()),
        (card("alt+F4"), click, ()),
    )
    for number, (open_something, reason, left) in enumerate(cases):
        screen.begin_run()
        until(lambda: source.output, "the output never came on")
        open_something()
        if reason == click:
            screen.click(STOP)
        else:
            screen.tool("key", "F12" if reason == key else "Escape")
        case = f"{reason} with {open_something.__name__}: run goes on"
        until(lambda n=number: screen.ended()[n][0] != "running", case)
        assert screen.ended()[number] == ("aborted", reason), case
        assert not source.output, f"{case}: the source was told nothing"
        screen.tool("mouseup", "1")
        for title in left:
            until(lambda title=title: screen.shut(title), f"{title} stays open")
    screen.tool("key", "Escape")  # the question on closing: keep it open
    screen.keys("alt+F4")
    assert screen.program.wait(LONGEST) == 0
