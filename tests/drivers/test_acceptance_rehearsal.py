"""The hardware checklist itself runs, on the compiled library in real time."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EMULATOR = Path(__file__).with_name("ps3000a_emulator.c")


def test_the_checklist_passes_on_the_emulator(tmp_path: Path) -> None:
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        pytest.skip("no C compiler")
    file = tmp_path / "libps3000a.so.2"
    flags = ["-O2", "-shared", "-fPIC", str(EMULATOR), "-lpthread", "-lm"]
    subprocess.run([compiler, "-o", str(file), *flags], check=True)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider",
         "tests/hardware/test_picoscope.py",
         # its generator is wired to nothing
         "-k", "(not lost or 1000000) and not test_generator"],
        cwd=ROOT, check=False, capture_output=True, text=True,
        env=os.environ | {
            "TACTILE_LAB_HARDWARE": "picoscope",
            "TACTILE_LAB_PS3000A": str(file),
            "TACTILE_LAB_SECONDS": "0.5",
            "EMULATOR_REAL_TIME": "1",
        },
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "FACT callback on the polling thread: True" in done.stdout
    assert "3 skipped" in done.stdout  # those that need a person
