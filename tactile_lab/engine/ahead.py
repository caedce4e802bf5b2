"""What an engine needs, loaded and used once: to import this does it.

The process that engines are forked from (`engine.process`) imports this before the
first is asked for. Nothing of it touches an instrument or writes a file.
"""

from __future__ import annotations

import gc
import os
from contextlib import suppress
from importlib import import_module

RUNS = "tactile_lab.engine.execution", "tactile_lab.store.stored_run"
"""What every run needs, and whoever reads one: 16 MB in each that loads it alone."""

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads are not forked


def load() -> None:
    """Load what is needed to plan a run, to ask who is on a bench, and for spikes."""
    gc.disable()  # modules leave no garbage, and to look for it takes a tenth of all
    from tactile_lab.code_cache import compiled_apart
    from tactile_lab.engine.jobs import bench_of, check
    from tactile_lab.engine.memory import share_heap, trim
    from tactile_lab.engine.request import Request
    from tactile_lab.errors import TactileLabError
    from tactile_lab.spikes.detector import compile_search

    share_heap()

    def use() -> None:
        with suppress(TactileLabError, OSError):  # told to whoever asks for it
            check(bench_of(Request("demo", (), "sim").load(), realtime=False))
        compile_search()

    compiled_apart(use)
    for module in RUNS:
        import_module(module)
    trim()
    gc.freeze()  # the collector would touch, and so copy, all of it in each fork
    gc.enable()


load()
