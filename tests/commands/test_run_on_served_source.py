"""`tactile-lab run` on a source that outlives it, ended in every way."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import closing

import pytest
from served_source import Source

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


def begun(folder, source):
    """A run on the source, once its current flows."""
    (folder / "scene.toml").write_text(SCENE)
    run = subprocess.Popen(
        [
            *(sys.executable, "-m", "tactile_lab", "run", "scene.toml"),
            *("--bench", "bench.toml", "--no-report", "--json"),
        ],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=os.environ | {"XDG_STATE_HOME": str(folder)},
    )
    until = time.monotonic() + PATIENCE
    while not any(d["what"] == "set" and d["value"] > 0.2 for d in source.told()):
        assert time.monotonic() < until, "no current ever flowed"
        time.sleep(0.01)
    return run


def wait_until_off(source, since):
    """Wait for output off after `since`, on this machine's monotonic clock."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        for change in source.told():
            if change["what"] == "output" and change["monotonic_s"] > since:
                assert change["value"] == 0
                return
        time.sleep(0.005)
    raise AssertionError("the output stayed on")


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
def test_the_output_goes_off(tmp_path, where, how, code):
    source = Source(tmp_path, where)
    with closing(source.served):
        run = begun(tmp_path, source)
        since = time.monotonic()
        run.send_signal(how)
        wait_until_off(source, since)
        out = run.communicate(timeout=PATIENCE)[0]
    assert run.returncode == code
    assert [d["value"] for d in source.told() if d["what"] == "set"][-1] == 0.0
    if code > 0:
        told = json.loads(out)
        assert told["coil_verified_off"] and told["status"] == "aborted"
    else:
        (folder,) = (tmp_path / "runs").iterdir()
        assert (folder / "run.json").exists()
