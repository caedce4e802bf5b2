"""A run of the whole program, watched from outside and killed, is not lost."""

import os
import signal
import subprocess
import sys
import time

import h5py
import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli
from tactile_lab.errors import RunFolderError
from tactile_lab.store.run import Run


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
def test_a_killed_run_is_seen_recovered_and_sound(tmp_path):
    command = [sys.executable, "-c", "from tactile_lab.cli import main; main()", "run"]
    command += ["--no-report", "--out", str(tmp_path)]
    command += ["--set", 'protocol.levels=["100 mN"]', "--set", "protocol.hold=300 s"]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as program:
        seen, path = 0, None
        until = time.monotonic() + 100
        while seen < 600_000 and time.monotonic() < until:
            time.sleep(0.1)
            path = next(iter(tmp_path.glob("*/data.h5")), None)
            if path is None:
                continue
            try:
                with Run.load(path.parent) as run:
                    seen = run.samples
            except RunFolderError:
                continue  # its datasets are just being declared
        os.kill(program.pid, signal.SIGKILL)
    assert path is not None
    assert seen >= 600_000

    def tell(*arguments):
        return CliRunner().invoke(cli, [str(argument) for argument in arguments])

    with h5py.File(path, "r", libver="latest", swmr=True) as file:
        assert file["samples/V_K"].shape[0] >= seen
    assert "cut short" in tell("runs", tmp_path).output
    assert tell("verify", path.parent).exit_code == 1
    assert tell("recover", path.parent).exit_code == 0
    assert tell("verify", path.parent).exit_code == 0
    assert "recovered" in tell("show", path.parent).output
    with h5py.File(path, "r") as file:
        assert file["samples/V_K"].shape[0] >= seen
        assert file["samples/V_K"].shape == file["samples/V_C1"].shape
