"""Outputs are whole or as they were, on a disk that fills up while they are written."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from full_disk import full_after

from gui.setup.presets import save_preset
from tactile_lab.commands import validate
from tactile_lab.errors import RecordingError, TactileLabError
from tactile_lab.scene.load import load
from tactile_lab.scene.write_bench import write_bench
from tactile_lab.store.folder import RunFolder
from tactile_lab.validation.accuracy import COLUMNS, write_csv
from tactile_lab.whole_file import replacing, write_text

BENCH = Path("tactile_lab/scene/simulated_bench.toml").read_text(encoding="utf-8")


def preset(path: Path) -> None:
    save_preset(path.parent.parent, path.stem, load("demo"))


def report_of_the_solver(path: Path) -> None:
    validate._write("word " * 100, path.parent, path.name)


def input_of_a_run(path: Path) -> None:
    root = path.parents[1]
    folder = RunFolder(root, {}, (root / "log").open("w", encoding="utf-8"))
    try:
        folder.write_text("pulses/a.toml", "word " * 100)
    finally:
        folder._log.close()


WRITERS: list[Callable[[Path], object]] = [
    preset,
    report_of_the_solver,
    input_of_a_run,
    lambda path: write_csv([], path),
    lambda path: write_bench(BENCH, path),
]


def test_no_folder_is_made_for_what_has_no_room(tmp_path: Path) -> None:
    with (
        pytest.raises(RecordingError, match=f"disk of {tmp_path} has"),
        replacing(tmp_path / "csv" / "signals.csv", 1 << 60),
    ):
        raise AssertionError("there was room")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("write", WRITERS)
def test_a_full_disk_leaves_what_was_there(tmp_path: Path, write) -> None:
    path = tmp_path / "pulses" / "a.toml"
    path.parent.mkdir()
    path.write_text("as it was")
    with full_after(50), suppress(OSError, TactileLabError):
        write(path)
    assert path.read_text() == "as it was"
    assert list(path.parent.iterdir()) == [path], "nothing else is left of it"


def test_two_that_write_one_file_leave_it_whole(tmp_path: Path) -> None:
    """The one that ended first put what the other had begun there, and said done."""
    path = tmp_path / "run.mat"
    with replacing(path) as first:
        first.write_text("first, whole")
        with replacing(path) as second:
            second.write_text("sec")
            with replacing(path) as third:
                third.write_text("third, whole")
            assert path.read_text() == "third, whole"
            second.write_text("second, whole")
        assert path.read_text() == "second, whole"
    assert path.read_text() == "first, whole"
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_killed_program_had_begun_is_taken_away(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    begin = (
        "import os, signal, pathlib\n"
        "from tactile_lab.whole_file import replacing\n"
        f"with replacing(pathlib.Path({str(path)!r})) as part:\n"
        "    part.write_text('begun')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    killed = subprocess.run([sys.executable, "-c", begin], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert len(list(tmp_path.iterdir())) == 1
    write_text(path, "whole")
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_written_is_there() -> None:
    assert len(",".join(COLUMNS)) > 50, "the disk is full before its first line ends"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes")
def test_no_file_takes_the_place_of_a_device_or_a_pipe(tmp_path):
    """A figure for /dev/full became a file of that name, and the device was gone."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RecordingError, match="a device or a pipe"):
        write_text(tmp_path / "pipe", "text")
    assert (tmp_path / "pipe").is_fifo()
    assert len(list(tmp_path.iterdir())) == 1


def test_a_folder_is_not_a_file_to_be(tmp_path, monkeypatch):
    """Said before anything is written; "." has no name to write a part beside."""
    monkeypatch.chdir(tmp_path)
    for folder in (tmp_path, Path(".")):
        with pytest.raises(IsADirectoryError), replacing(folder):
            pytest.fail("it was begun")
    assert not list(tmp_path.iterdir())
