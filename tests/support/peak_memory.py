"""What something takes of memory at most; tracemalloc sees only Python's part."""

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest

from tactile_lab.engine.memory import give_back

T = TypeVar("T")

tells_peak = pytest.mark.skipif(
    sys.platform != "linux", reason="Linux tells a process its peak"
)


def peak(doing: Callable[[], T]) -> tuple[float, T]:
    """Memory that it takes at most beyond what there was, MB; and its answer.

    What tests before it have freed is given back, or it could be taken unseen.
    """
    give_back()
    Path("/proc/self/clear_refs").write_text("5")
    before = _most()
    found = doing()
    return _most() - before, found


def _most() -> float:
    text = Path("/proc/self/status").read_text()
    found = re.search(r"VmHWM:\s+(\d+)", text)
    assert found is not None
    return int(found[1]) / 1024
