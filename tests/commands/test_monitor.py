import contextlib
import os
import signal
import subprocess
import sys

import pytest

from tactile_lab.report.from_run import read

START = "import sys; from tactile_lab.cli import main; sys.exit(main())"


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="a signal of POSIX")
def test_enter_and_a_signal_record_and_ctrl_c_ends(tmp_path):
    watching = subprocess.Popen(
        [sys.executable, "-c", START, "monitor", "--keep", "2", "--out", "kept",
         "--set", "record.sample_rate=10 kS/s"],
        cwd=tmp_path, text=True, bufsize=1, env=os.environ,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        while "V_C1 4.3" not in (line := watching.stderr.readline()):
            assert line, "it ended before it saw V_C1"
        assert "mV above threshold: silent" in line
        watching.stdin.write("\n")
        watching.stdin.flush()
        first = watching.stdout.readline().split()[-1]
        watching.send_signal(signal.SIGUSR1)
        line = watching.stdout.readline()
        assert line, watching.stderr.read()
        second = line.split()[-1]
        watching.send_signal(signal.SIGINT)
        _, said = watching.communicate(timeout=120)
    finally:
        watching.kill()
    assert watching.returncode == 0, said
    assert first != second
    for folder in (first, second):
        assert read(tmp_path / folder).status == "complete"
        assert (tmp_path / folder / "report.html").exists()


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_that_is_no_ctrl_c_tells_its_number(name, tmp_path):
    """Both ended it with 0, as if somebody had seen enough."""
    if not hasattr(signal, name):
        pytest.skip("a signal of POSIX")
    number = getattr(signal, name)
    watching = subprocess.Popen(
        [sys.executable, "-c", START, "monitor", "--set", "record.sample_rate=10 kS/s"],
        cwd=tmp_path, text=True, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        while "V_C1 4.3" not in (line := watching.stderr.readline()):
            assert line, "it ended before it saw V_C1"
        watching.send_signal(number)
        watching.communicate(timeout=120)
    finally:
        watching.kill()
    assert watching.returncode == 128 + number


@pytest.mark.skipif(sys.platform == "win32", reason="a terminal of POSIX")
def test_what_a_key_does_is_read_in_80_columns_and_enter_records(tmp_path):
    """The line was cut at "Enter rec…": nobody could read how to record or to end."""
    import fcntl
    import pty
    import struct
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    watching = subprocess.Popen(
        [sys.executable, "-c", START, "monitor", "--keep", "2", "--out", "kept",
         "--set", "record.sample_rate=10 kS/s"],
        cwd=tmp_path, stdin=theirs, stdout=theirs, stderr=theirs,
        env={**os.environ, "TERM": "xterm"},
    )  # fmt: skip
    os.close(theirs)
    seen = b""
    try:
        while b"V_C1 4.3" not in seen:
            seen += os.read(ours, 4096)
        os.write(ours, b"\n")
        while b"run     kept" not in seen:
            seen += os.read(ours, 4096)
        watching.send_signal(signal.SIGINT)
        with contextlib.suppress(OSError):  # the terminal's end
            while part := os.read(ours, 4096):
                seen += part
        assert watching.wait(timeout=120) == 0
    finally:
        watching.kill()
        os.close(ours)
    assert "Enter records, Ctrl-C ends" in seen.decode(errors="replace")
    (folder,) = (tmp_path / "kept").iterdir()
    assert read(folder).status == "complete"
