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
        window = self.named(MAIN)
        self.tool("windowactivate", "--sync", window, "key", *pressed)

    def click(self, from_right: int, down: int = 34, button: int = 1) -> None:
        """Click that many px from the right edge, into the header unless told."""
        window = self.named(MAIN)
        said = self.tool("getwindowgeometry", "--shell", window).split()
        width = dict(line.split("=") for line in said)["WIDTH"]
        at = str(int(width) - from_right), str(down)
        move = ("mousemove", "--sync", "--window", window, *at)
        self.tool(*move, "click", str(button))

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
def on_screen(tmp_path: Path, source: Source) -> Iterator[OnScreen]:
    """The window on a screen, its coil source at a port of its own."""
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


STOP, MENU, NOTE, PROTOCOL = 130, 440, 170, 1100
"""Where STOP, menu, field for notes and list of protocols are, px from the right."""

HEIGHT, LOG = 760, 82
"""Of the window, and how far the field for notes is above its lower edge, px."""

DIALOGS = ("Export this view", "Open a scene", "Open a run", "Save the scene")


@pytest.mark.timeout(900)
def test_stop_acts_whatever_is_open(on_screen: OnScreen, source: Source) -> None:
    """One act on STOP ends the run, with a dialog, its question or a menu open.

    The witness is the source: what it was told, not what the window says.
    """
    screen = on_screen

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

    export = dialog("ctrl+e", "Export this view")

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

    def open_context_menu() -> None:
        alone = screen.seen()
        screen.click(NOTE, HEIGHT - LOG, 3)
        until(lambda: screen.seen() > alone, "no context menu came")

    def open_list() -> None:
        alone = screen.seen()
        screen.click(PROTOCOL, 143)
        until(lambda: screen.seen() > alone, "no list came")

    (screen.runs.parent / "view.png").touch()
    cases: tuple[tuple[Callable[[], None], str, str], ...] = (
        (export, "click", "STOP in the window"),
        (export, "F12", "STOP by F12"),
        (export, "Escape", "STOP by Esc"),
        (replace, "click", "STOP in the window"),
        (replace, "F12", "STOP by F12"),
        (open_menu, "click", "STOP in the window"),
        (open_menu, "Escape", "STOP by Esc"),
        (open_list, "click", "STOP in the window"),
        (open_context_menu, "click", "STOP in the window"),
        (dialog("ctrl+o", "Open a scene"), "click", "STOP in the window"),
        (dialog("ctrl+shift+o", "Open a run"), "click", "STOP in the window"),
        (dialog("ctrl+s", "Save the scene"), "F12", "STOP by F12"),
        (card("ctrl+k"), "click", "STOP in the window"),
        (card("F1"), "Escape", "STOP by Esc"),
        (card("ctrl+comma"), "F12", "STOP by F12"),
    )
    for number, (open_something, act, reason) in enumerate(cases):
        screen.begin_run()
        until(lambda: source.output, "the output never came on")
        open_something()
        if act == "click":
            screen.click(STOP)
        else:
            screen.tool("key", act)
        case = f"{act} with {open_something.__name__}: run goes on"
        until(lambda n=number: len(screen.stopped()) > n, case)
        assert screen.stopped()[-1] == reason
        assert not source.output, f"{case}: the source was told nothing"
        for title in ("Replace the file.", *DIALOGS):
            for window in screen.named(title).split():
                screen.tool("windowactivate", "--sync", window, "key", "Escape")
