"""The window on a virtual screen with a window manager, driven by keys and clicks."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

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
sample_rate = "20 kS/s"
"""
"""A run that lasts until it is stopped, and so slow that a busy computer keeps pace."""

LONGEST = 90.0


@dataclass(frozen=True)
class OnScreen:
    """The program, and what a person can do to it.

    Attributes:
        program: the window's process.
        environment: with the screen it is on.
        runs: folder of its runs.
    """

    program: subprocess.Popen[bytes]
    environment: dict[str, str]
    runs: Path

    def tool(self, *arguments: str) -> str:
        """What xdotool says; "" if it finds nothing."""
        done = subprocess.run(
            ["xdotool", *arguments],
            env=self.environment, capture_output=True, text=True, timeout=20,
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
        window = self.named("Tactile Lab")
        self.tool("windowactivate", "--sync", window, "key", *pressed)

    def click(self, from_right: int) -> None:
        """Click into the header, that many px from its right edge."""
        window = self.named("Tactile Lab")
        said = self.tool("getwindowgeometry", "--shell", window).split()
        width = dict(line.split("=") for line in said)["WIDTH"]
        at = str(int(width) - from_right), "34"
        self.tool("mousemove", "--sync", "--window", window, *at, "click", "1")

    def begin_run(self) -> None:
        """Have a run begin, as soon as bench and plan are there."""
        before = len(list(self.runs.glob("*/run.json")))

        def begun() -> bool:
            self.keys("ctrl+r")
            return len(list(self.runs.glob("*/run.json"))) > before

        until(begun, "no run began")

    def stopped(self) -> list[str]:
        """Why each run ended that was stopped with its coil off, oldest first."""
        files = sorted(self.runs.glob("*/run.json"))
        ended = (json.loads(file.read_text()) for file in files)
        return [run["reason"] for run in ended if run["status"] == "aborted"]


def until(done: Callable[[], object], otherwise: str) -> None:
    """Wait for something; fail where it does not come."""
    end = time.monotonic() + LONGEST
    while not done():
        assert time.monotonic() < end, otherwise
        time.sleep(0.2)


@pytest.fixture
def on_screen(tmp_path: Path) -> Iterator[OnScreen]:
    read, write = os.pipe()
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24"],
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
        runs, scene = tmp_path / "runs", tmp_path / "slow.toml"
        scene.write_text(SCENE)
        program = subprocess.Popen(
            [sys.executable, "-m", "tactile_lab", "gui", scene, "--out", runs],
            env=environment, cwd=tmp_path,
        )  # fmt: skip
        started.append(program)
        made = OnScreen(program, environment, runs)
        until(lambda: made.named("Tactile Lab"), "no window came")
        yield made
    finally:
        for process in reversed(started):
            if process.poll() is None:
                process.terminate()
                process.wait(10)


@pytest.mark.timeout(400)
def test_run_stop_and_close_by_keys(on_screen: OnScreen) -> None:
    on_screen.begin_run()
    on_screen.keys("Escape")
    until(on_screen.stopped, "Esc did not stop the run")
    on_screen.keys("alt+F4")
    assert on_screen.program.wait(LONGEST) == 0


STOP, MENU = 130, 440
"""Where the button STOP and the menu are, px from the header's right edge."""


@pytest.mark.timeout(900)
def test_stop_acts_whatever_is_open(on_screen: OnScreen) -> None:
    """One act on STOP ends the run, with a dialog, its question or a menu open."""
    screen = on_screen

    def export() -> None:
        screen.keys("ctrl+e")
        until(lambda: screen.named("Export this view"), "no dialog came")

    def replace() -> None:
        export()
        dialog = screen.named("Export this view")
        # a file of that name is there already
        screen.tool("windowactivate", "--sync", dialog, "key", "Return")
        until(lambda: screen.named("Replace the file."), "no question came")

    def open_menu() -> None:
        alone = screen.seen()
        screen.click(MENU)
        until(lambda: screen.seen() > alone, "no menu came")

    (screen.runs.parent / "view.png").touch()
    cases: tuple[tuple[Callable[[], None], str, str], ...] = (
        (export, "click", "STOP in the window"),
        (export, "F12", "STOP by F12"),
        (export, "Escape", "STOP by Esc"),
        (replace, "click", "STOP in the window"),
        (replace, "F12", "STOP by F12"),
        (open_menu, "click", "STOP in the window"),
        (open_menu, "Escape", "STOP by Esc"),
    )
    for number, (open_something, act, reason) in enumerate(cases):
        screen.begin_run()
        open_something()
        if act == "click":
            screen.click(STOP)
        else:
            screen.tool("key", act)
        case = f"{act} with {open_something.__name__}: run goes on"
        until(lambda n=number: len(screen.stopped()) > n, case)
        assert screen.stopped()[-1] == reason
        for title in ("Replace the file.", "Export this view"):
            for window in screen.named(title).split():
                screen.tool("windowactivate", "--sync", window, "key", "Escape")
