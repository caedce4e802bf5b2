"""A long session through X: what a person does, and seeded clicks and keys between.

    python tests/benchmarks/window_session.py [SEED] [SECONDS]

The window stands on a virtual screen. In turn it is made to run, queue, edit, stop,
meet a fault (a source that falls silent, one that answers late, a pulled plug), find
back, compare and export; between these, keys and clicks at random places and on random
buttons, from one seed. The engine is a process of its own, as in life, and the
simulated source in it the witness: it tells when its output went on and off.

It ends with 1 where an exception came, where the window said that the coil is off, or
was ready, for over two seconds while the output was on, where it was ready without
knowing the coil, where a STOP left the output on for five seconds, where the program
ended, or where the window's memory grew by more than a fifth from the second quarter
of the session to the last. The row has the time from STOP to the output off, the ramp
and what `xdotool` takes included; of a STOP that came late it is told how much of it
threads waited for a processor.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from bisect import bisect
from collections import deque
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import watched_engine

HERE = Path(__file__).resolve().parent
PROGRAM = "import window_watched; window_watched.main()"
SIZE = 1366, 768
LIE, STOPPED, PRESSED, TRIES = 2.0, 5.0, 5.0, 3
LONGEST = 30.0
"""For which an output that STOP left on is watched, s."""
LINES = 30
"""Of the window's log that are told where the session was lost."""
KEYS = (
    "space f a z c 1 2 m shift+m plus minus BackSpace shift+BackSpace x Left Right "
    "period comma Home End n F1 F5 F7 F8 F11 ctrl+1 ctrl+2 ctrl+3 ctrl+4 ctrl+z ctrl+y "
    "ctrl+f ctrl+i ctrl+k ctrl+comma ctrl+o ctrl+s Tab Tab Tab shift+Tab Return Down "
    "Up Prior Next 5 9 Delete ctrl+a ctrl+Return ctrl+shift+Return ctrl+r Escape"
).split()
FAULTS = ("missing", "late", "unplug")
LEFT_ALONE = (
    "STOP",
    "COIL",
    "Menu",
    "Open the report",
    "Open the run",
    "Quit",
    "Delete",
)
"""Buttons that are pressed on purpose, lead out of the window, or move what is kept."""


Report = dict[str, Any]
"""What the program tells every tenth of a second."""

Switched = tuple[float, bool, str]
"""When an output went on or off, and of which source."""

Times = tuple[float, float]
"""For how long a thread worked, and waited for a processor, s."""
HEAD = (
    "| seed | s | rounds | keys, clicks, drags | memory in its second quarter, MB "
    "| in its last | longest pause of the window, s | STOP to output off, s | most "
    "| problems |\n"
    "|---|---|---|---|---|---|---|---|---|---|"
)
NOTHING: Report = {
    "state": "",
    "buttons": {},
    "open": [],
    "dialogs": [],
    "keyboard": "",
}
"""What is known before the program has told anything."""


class LostError(Exception):
    """The session cannot go on."""


def times(process: int, threads: Iterable[int]) -> Times:
    """Of threads of a process together, as the scheduler counts them."""
    each = [Path(f"/proc/{process}/task/{one}/schedstat") for one in threads]
    told = [tuple(map(int, one.read_text().split())) for one in each if one.exists()]
    return sum(one[0] for one in told) / 1e9, sum(one[1] for one in told) / 1e9


class Session:
    """The program on its screen, and the one who drives it."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.random = random.Random(seed)
        self.folder = folder
        self.problems: list[str] = []
        self.reports: list[Report] = []
        self.switched: list[Switched] = [(0.0, False, "no source")]
        self.stops: list[float] = []
        self.log: deque[str] = deque(maxlen=LINES)
        self.done: dict[str, int] = {}
        read, write = os.pipe()
        screen = "x".join(map(str, (*SIZE, 24)))
        self._started: list[subprocess.Popen[Any]] = [
            subprocess.Popen(
                # one that resets refuses who comes as the last client leaves
                ["Xvfb", "-noreset", "-displayfd", str(write), "-screen", "0", screen],
                pass_fds=(write,), stderr=subprocess.DEVNULL,
            )
        ]  # fmt: skip
        os.close(write)
        with os.fdopen(read) as told:
            display = f":{told.readline().strip()}"
        opens = folder / "bin" / "xdg-open"  # what a desktop has; it shows nothing here
        opens.parent.mkdir()
        opens.symlink_to(shutil.which("true") or "/bin/true")
        self.env = {
            **os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb",
            "PATH": f"{opens.parent}:{os.environ['PATH']}",
            "HOME": str(folder), "XDG_DATA_HOME": str(folder / "d"),
            "XDG_CONFIG_HOME": str(folder / "config"),
        }  # fmt: skip
        self._started.append(
            subprocess.Popen(["openbox"], env=self.env, stderr=subprocess.DEVNULL)
        )
        self.program = subprocess.Popen(
            [sys.executable, "-c", PROGRAM],
            env={**self.env, "PYTHONPATH": str(HERE)}, cwd=folder, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        self._started.append(self.program)
        threading.Thread(target=self._listen, daemon=True).start()

    def enter(self) -> None:
        """Wait for the window and its bench."""
        self.wait(lambda: self.now["state"] == "ready", 180, "ready")
        # the wheel on the bare desktop would go to another, where no window is
        self.tool("set_num_desktops", 1)
        self.main = self.tool("search", "--onlyvisible", "--name", ".*Tactile Lab")
        self.main = self.main.split()[0]

    def _listen(self) -> None:
        assert self.program.stdout is not None
        for line in self.program.stdout:
            told = json.loads(line)
            if "problem" in told:
                self.problems.append(told["problem"])
            elif "log" in told:
                self.log.append(told["log"])
            else:
                self.reports.append(told)

    @property
    def now(self) -> Report:
        """What the program told last."""
        return self.reports[-1] if self.reports else NOTHING

    @property
    def output(self) -> bool:
        """Whether the source's output is on, as the source told last."""
        return self.switched[-1][1]

    def look(self) -> None:
        """Take what the source has told since: when it went on and off."""
        file = self.folder / watched_engine.SOURCE
        lines = file.read_text().splitlines() if file.exists() else []
        for line in lines[len(self.switched) - 1 :]:
            told = json.loads(line)
            self.switched.append((told["at"], told["on"], told["name"]))

    def wait(self, done: Callable[[], object], longest: float, what: str) -> None:
        end = time.monotonic() + longest
        while True:
            self.look()
            if done():
                return
            if self.program.poll() is not None:
                raise LostError(f"the program ended with {self.program.returncode}")
            if time.monotonic() > end:
                here = self.now
                left = ", ".join((*here["open"], *here["dialogs"])) or "nothing"
                raise LostError(
                    f"not {what} within {longest} s; it is {here['state']}; open: "
                    f"{left}; keys: {here['keyboard']}"
                )
            time.sleep(0.1)

    def tool(self, *arguments: str | int) -> str:
        done = subprocess.run(
            ["xdotool", *map(str, arguments)],
            env=self.env, capture_output=True, text=True, timeout=60,
        )  # fmt: skip
        return done.stdout.strip()

    def key(self, *keys: str) -> None:
        self.tool("windowfocus", self.main, "key", *keys)

    def press(self, name: str) -> bool:
        """Click a button by its name, if it is there to be clicked."""
        place = self.now["buttons"].get(name)
        if place:
            self.tool("mousemove", *place, "click", 1)
        return bool(place)

    def tell(self, word: str) -> None:
        assert self.program.stdin is not None
        self.program.stdin.write(f"{word}\n")
        self.program.stdin.flush()

    def fail(self, how: str) -> None:
        """Have the source fail from now on; "" lets it work again."""
        (self.folder / watched_engine.FAULT).write_text(how)

    def processor(self) -> tuple[Times, Times]:
        """Of the window's own thread, and of the engine's together, so far."""
        window = times(self.program.pid, [self.program.pid])
        engine = self.now.get("engine")
        if not engine:
            return window, (0.0, 0.0)
        return window, times(engine, map(int, os.listdir(f"/proc/{engine}/task")))

    # --- what a person does

    def anything(self, seconds: float) -> None:
        """Keys and clicks without a plan."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and self.program.poll() is None:
            what = self.random.choices(
                ("key", "button", "click", "drag", "wheel", "type"), (6, 5, 3, 2, 2, 2)
            )[0]
            self.done[what] = self.done.get(what, 0) + 1
            x, y = self.random.randrange(SIZE[0]), self.random.randrange(90, SIZE[1])
            if what == "key":
                self.key(self.random.choice(KEYS))
            elif what == "type":
                self.tool("type", self.random.choice(("80 mN", "300 ms", "-1 s", "x")))
            elif what == "button":
                names = sorted(
                    n for n in self.now["buttons"] if not n.startswith(LEFT_ALONE)
                )
                if names:
                    self.press(self.random.choice(names))
            elif what == "drag":
                self.tool("mousemove", x, y, "mousedown", 1)
                self.tool("mousemove", self.random.randrange(SIZE[0]), y, "mouseup", 1)
            else:
                button = 1 if what == "click" else self.random.choice((4, 5))
                self.tool("mousemove", x, y, "click", button)

    def clear(self) -> None:
        """Stop what is in progress, close what is open, and be ready."""
        self.tool("keyup", "shift", "keyup", "ctrl", "mouseup", 1)
        self.fail("")
        self.restore()

        def ready() -> bool:
            left = self.now["open"] or self.now["dialogs"]
            if self.now["state"] == "ready" and not left:
                return True
            if self.now["state"] == "no bench":
                self.tell("connect")
            if time.monotonic() - self.now["at"] > 0.5:
                return False  # keys would pile up, and Esc in Ready asks all anew
            if self.press("Acknowledge and reset"):
                time.sleep(1)
            elif self.now["dialogs"]:
                self.restore()
                # not in the window, where Esc is STOP
                pid = str(self.program.pid)
                for one in self.tool("search", "--onlyvisible", "--pid", pid).split():
                    if one != self.main:
                        self.tool("windowfocus", one, "key", "Escape")
                time.sleep(1)
            elif self.now["open"] or self.now["state"] == "running":
                self.restore()
                self.key("Escape")
                time.sleep(1)
            return False

        self.wait(ready, 120, "ready again")

    def restore(self) -> None:
        """Bring back what a click into a title bar has minimised."""
        self.tool("windowmap", self.main)
        for dialog in self.now["dialogs"]:
            title = dialog.partition(" ")[2]
            self.tool("search", "--name", f"^{title}$", "windowmap", "%@")

    def begin(self) -> None:
        """Have the form's run begin; its scene is opened anew where it is unusable.

        A computer too busy for the run's watchdogs ends it with a fault: again then.
        So also where a dialog opens late that was asked for before.
        A click may come while the scene is still planned, and is lost on the button:
        one that is ready is clicked again.
        """
        pressed = float("-inf")

        def runs() -> bool:
            nonlocal pressed
            here = self.now
            if here["state"] == "ready" and here["at"] - pressed > PRESSED:
                pressed = here["at"] if self.press("Run") else pressed
            return self.output or here["state"] == "fault" or came_late()

        def came_late() -> bool:  # of the keys before
            return bool(self.now["open"] or self.now["dialogs"])

        for _ in range(TRIES):
            self.clear()
            self.tell("scene")
            self.wait(
                lambda: "Run" in self.now["buttons"] or came_late(), 60, "planned"
            )
            pressed = float("-inf")
            self.wait(runs, 90, "running with the coil on")
            if self.output:
                return
        raise LostError(f"no run in {TRIES} tries; it is {self.now['state']}")

    def stop(self) -> None:
        """STOP by key or button, and see to it that the output goes off."""
        how = self.random.choice(("F12", "Escape", "button"))
        place, before = self.now["stop"], self.processor()
        self.look()
        was_on, begun = self.output, time.monotonic()
        if how == "button":
            self.tool("mousemove", *place, "click", 1)
        else:
            self.key("F12" if how == "F12" else "Escape")
        pressed = time.monotonic()
        while self.output and time.monotonic() < pressed + LONGEST:
            self.look()
            time.sleep(0.02)
        if not was_on:
            return
        self.stops.append(self.switched[-1][0] - begun)
        if self.output or self.switched[-1][0] > pressed + STOPPED:
            used = np.subtract(self.processor(), before)
            self.problems.append(
                f"{how} left the output on for {self.stops[-1]:.1f} s, in which the "
                f"window's thread worked {used[0, 0]:.2f} s and waited {used[0, 1]:.2f}"
                f" for a processor, the engine's {used[1, 0]:.2f} and {used[1, 1]:.2f}"
            )

    def round(self) -> None:
        """All that a session holds, once."""
        self.begin()
        self.key("ctrl+Return")
        self.anything(8)
        self.stop()
        self.begin()
        self.fail(self.random.choice(FAULTS))
        self.anything(6)
        self.clear()
        self.begin()
        self.wait(lambda: self.now["state"] != "running", 120, "at the end of its run")
        self.clear()
        self.key("ctrl+2")
        time.sleep(1)
        ticks = [n for n in self.now["buttons"] if n.startswith("Compare 2")][:2]
        for name in ticks:
            self.press(name)
        time.sleep(0.5)
        self.press("Compare")
        self.anything(5)
        self.clear()
        self.key("ctrl+e")
        time.sleep(1.5)
        name = self.random.choice(("png", "svg", "csv"))
        self.tool("type", str(self.folder / f"view{len(self.reports)}.{name}"))
        self.tool("key", "Return")
        self.anything(5)
        self.done["round"] = self.done.get("round", 0) + 1

    def close(self) -> None:
        for process in reversed(self._started):
            if process.poll() is None:
                process.terminate()
                process.wait(30)


def lies(reports: list[Report], switched: list[Switched]) -> list[str]:
    """Where the window said for longer than `LIE` what the source contradicts."""
    found = []
    begun: dict[str, float] = {}
    for told in reports:
        _, on, name = switched[bisect(switched, (told["at"], True)) - 1]
        ready = told["state"] == "ready" and not told["manual"]
        claims = {
            "the coil is off while its output is on": on and told["truth"] == "off",
            "ready while the output is on": on and ready,
            "ready without knowing the coil": ready and told["truth"] == "unknown",
        }
        for claim, false in claims.items():
            if not false:
                begun.pop(claim, None)
            elif told["at"] - begun.setdefault(claim, told["at"]) > LIE:
                at = f"at {told['at'] - reports[0]['at']:.0f} s"
                found.append(f"{claim}, {at} of {name}: {told['words']}")
                begun[claim] = float("inf")
    return found


def drive(seed: int, seconds: float) -> tuple[str, bool]:
    """One session; its row, and whether nothing was wrong."""
    # what the program started may still write as it ends
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        session = Session(seed, Path(folder))
        try:
            session.enter()
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                session.round()
        except LostError as lost:
            session.problems += [str(lost), *session.log]
        finally:
            session.close()
    session.look()
    session.problems += lies(session.reports, session.switched)
    memory = np.array([told["memory"] for told in session.reports])
    quarter = max(len(memory) // 4, 1)
    before, after = (
        np.median(memory[quarter : 2 * quarter]),
        np.median(memory[-quarter:]),
    )
    if after > 1.2 * before:
        session.problems.append(f"memory grew from {before:.0f} to {after:.0f} MB")
    lived = session.reports[-1]["at"] - session.reports[0]["at"]
    gap = max(np.diff([told["at"] for told in session.reports]))
    stops = np.array(session.stops or [np.nan])
    acts = sum(n for what, n in session.done.items() if what != "round")
    row = (
        f"| {seed} | {lived:.0f} | {session.done.get('round', 0)} | {acts} | "
        f"{before:.0f} | {after:.0f} | {gap:.1f} | {np.median(stops):.2f} | "
        f"{stops.max():.2f} | {len(session.problems)} |"
    )
    return "\n".join([row, *session.problems]), not session.problems


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seed", type=int, nargs="?", default=1)
    parser.add_argument("seconds", type=float, nargs="?", default=600.0)
    options = parser.parse_args()
    row, well = drive(options.seed, options.seconds)
    print(HEAD, row, sep="\n")
    sys.exit(not well)


if __name__ == "__main__":
    main()
