"""What an engine needs, loaded and used once: to import this does it.

The process that engines are forked from (`engine.process`) imports this before the
first is asked for. Nothing of it touches an instrument or writes a file.
"""

from __future__ import annotations

import gc
import os
from contextlib import suppress

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads are not forked


def load() -> None:
    """Load what is needed to plan a run and to ask who is on a bench."""
    from tactile_lab.engine.jobs import bench_of, check
    from tactile_lab.engine.memory import share_heap, trim
    from tactile_lab.engine.request import Request
    from tactile_lab.errors import TactileLabError

    share_heap()
    with suppress(TactileLabError, OSError):  # told to whoever asks for it
        check(bench_of(Request("demo", (), "sim").load(), realtime=False))
    trim()
    gc.freeze()  # the collector would touch, and so copy, all of it in each fork


load()
