"""A signal while a run is starting ends it before anything is opened."""

import os
import signal
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")

SWALLOWS = """
import os
import signal
import time
from typing import ClassVar

from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

try:  # as a callback from C, or a user's own `except`, swallows it
    for _ in range({times}):
        os.kill(os.getpid(), signal.{name})
        time.sleep(0.2)
except BaseException:
    pass


class Swallows(Protocol):
    name: ClassVar[str] = "swallows"
    title: ClassVar[str] = "A signal while starting"
    signals: ClassVar[tuple[str, ...]] = ("V_C1",)

    def trials(self) -> Trials:
        force = Waveform.pulse(0.05, ramp=0.1, hold=0.2, rest=0.1)
        yield Trial(force=force, label="50 mN")
"""


@pytest.mark.parametrize(("name", "times"), [("SIGTERM", 1), ("SIGINT", 2)])
def test_a_signal_while_starting_is_heeded(tmp_path, name, times):
    (tmp_path / "swallows.py").write_text(SWALLOWS.format(name=name, times=times))
    command = [
        sys.executable,
        "-m",
        "tactile_lab",
        "run",
        str(tmp_path / "swallows.py"),
    ]
    done = subprocess.run(
        [*command, "--out", str(tmp_path / "runs")],
        capture_output=True, text=True, check=False,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 128 + getattr(signal, name), done.stderr
    assert "Traceback" not in done.stderr
    assert "before anything is opened" in done.stderr
    assert not os.path.exists(tmp_path / "runs")
