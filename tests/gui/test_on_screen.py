"""One run on a virtual screen with a window manager, driven by keys."""

import os
import shutil
import subprocess
import sys
import time
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


def wait(ask: list[str], environment: dict[str, str], longest: float) -> str:
    end = time.monotonic() + longest
    while True:
        found = subprocess.run(ask, env=environment, capture_output=True, text=True)
        if found.returncode == 0 and found.stdout.strip():
            return found.stdout.split()[0]
        assert time.monotonic() < end, (ask, found.stderr)
        time.sleep(0.2)


def logged(runs: Path, text: str, longest: float) -> None:
    """Wait until a run's folder says so."""
    end = time.monotonic() + longest
    while not any(text in file.read_text() for file in runs.glob("*/run.json")):
        assert time.monotonic() < end, (text, list(runs.glob("*/run.json")))
        time.sleep(0.1)


@pytest.mark.timeout(400)
def test_run_stop_and_close_by_keys(tmp_path: Path) -> None:
    read, write = os.pipe()
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1800x1140x24"],
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
            [
                sys.executable,
                "-m",
                "tactile_lab",
                "gui",
                str(scene),
                "--out",
                str(runs),
            ],
            env=environment,
        )
        started.append(program)
        ask = ["xdotool", "search", "--onlyvisible", "--name", "^Tactile Lab$"]
        window = wait(ask, environment, LONGEST)

        def keys(*pressed: str) -> None:
            subprocess.run(
                ["xdotool", "windowactivate", "--sync", window, "key", *pressed],
                env=environment, check=True, timeout=20, stderr=subprocess.DEVNULL,
            )  # fmt: skip

        end = time.monotonic() + LONGEST
        while not list(runs.glob("*/run.json")):
            keys("ctrl+r")  # does nothing until bench and plan are there
            assert time.monotonic() < end, "Run never started"
            time.sleep(0.5)
        keys("Escape")
        logged(runs, '"aborted"', LONGEST)
        keys("alt+F4")
        assert program.wait(LONGEST) == 0
    finally:
        for process in reversed(started):
            if process.poll() is None:
                process.terminate()
                process.wait(10)
