"""`tactile-lab run` on a source served by another process, ended in every way."""

import json
import os
import signal
import subprocess
import sys
import time
from importlib import resources
from pathlib import Path

import pytest
from benches import SERVED

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")

SCENE = """
[protocol]
name = "pulses"
levels = ["80 mN"]
[record]
signals = ["force"]
"""

PATIENCE = 60.0
"""Longest wait for what a busy machine does late, s."""


class Served:
    """A served source, what it was told, and a run on it."""

    def __init__(self, folder: Path, where: str) -> None:
        self.folder = folder
        self.log = folder / "changes.jsonl"
        self.process = subprocess.Popen(
            [
                *(sys.executable, "-m", "tactile_lab", "serve-bench", "--json"),
                *("--coil", where, "--log", str(self.log)),
            ],
            stdout=subprocess.PIPE,
            text=True,
        )
        port = json.loads(self.process.stdout.readline())["coil"]
        (folder / "scene.toml").write_text(SCENE)
        row = resources.files("tactile_lab.instruments").joinpath(
            "rows", "coil", "kepco-bop.toml"
        )
        (folder / "patient.toml").write_text(
            row.read_text().replace("[serial]", '[serial]\ntimeout = "400 ms"')
        )
        (folder / "bench.toml").write_text(SERVED.format(port=port))

    def run(self) -> subprocess.Popen:
        """The run, once its current flows."""
        run = subprocess.Popen(
            [
                *(sys.executable, "-m", "tactile_lab", "run", "scene.toml"),
                *("--bench", "bench.toml", "--no-report", "--json"),
            ],
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=os.environ | {"XDG_STATE_HOME": str(self.folder)},
        )
        until = time.monotonic() + PATIENCE
        while not any(d["what"] == "set" and d["value"] > 0.2 for d in self.told()):
            assert time.monotonic() < until, "no current ever flowed"
            time.sleep(0.01)
        return run

    def told(self) -> list[dict]:
        """Everything the source was told so far."""
        text = self.log.read_text() if self.log.exists() else ""
        whole = text[: text.rfind("\n") + 1]
        return [json.loads(line) for line in whole.splitlines()]

    def wait_until_off(self, since: float) -> None:
        """Wait for output off after `since`, on this machine's monotonic clock."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            for change in self.told():
                if change["what"] == "output" and change["monotonic_s"] > since:
                    assert change["value"] == 0
                    return
            time.sleep(0.005)
        raise AssertionError("the output stayed on")


@pytest.fixture
def served(tmp_path):
    started = []

    def serve(where):
        started.append(Served(tmp_path, where))
        return started[-1]

    yield serve
    for one in started:
        one.process.terminate()
        one.process.wait(PATIENCE)
        one.process.stdout.close()


@pytest.mark.parametrize(
    ("where", "how", "code"),
    [
        ("pty", signal.SIGKILL, -9),
        ("tcp:0", signal.SIGKILL, -9),
        ("pty", signal.SIGSTOP, -9),
        ("tcp:0", signal.SIGTERM, 143),
        ("pty", signal.SIGINT, 130),
        ("tcp:0", signal.SIGHUP, 129),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_the_output_goes_off(served, where, how, code):
    served = served(where)
    run = served.run()
    since = time.monotonic()
    run.send_signal(how)
    served.wait_until_off(since)
    out = run.communicate(timeout=PATIENCE)[0]
    assert run.returncode == code
    assert [d["value"] for d in served.told() if d["what"] == "set"][-1] == 0.0
    if code > 0:
        told = json.loads(out)
        assert told["coil_verified_off"] and told["status"] == "aborted"
    else:
        (folder,) = (served.folder / "runs").iterdir()
        assert (folder / "run.json").exists()
