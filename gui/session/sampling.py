"""Telling the window the newest samples of whatever is watched in the engine."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from gui.session.messages import Samples, Told
from tactile_lab.acquisition.ending import CoilState
from tactile_lab.acquisition.live import Live

EVERY = 0.02
"""Seconds between two looks at the newest samples and at the coil."""


def tell_samples(
    live: Live,
    coil_state: Callable[[], CoilState],
    ended: threading.Event,
    tell: Callable[[Told], None],
) -> None:
    """Tell samples and the coil's state as they come, to the very last."""
    seen, last, said = 0, None, 0.0
    while True:
        over = ended.wait(EVERY)
        written, coil = live.written, coil_state()
        changed = coil != last or time.monotonic() - said > 0.2
        if written != seen or changed:
            first = seen if written >= seen else 0
            bins = {}
            if written != seen:
                bins = {s: live.since(first, s) for s in live.signals}
            tell(Samples(bins, coil))
            seen, last, said = written, coil, time.monotonic()
        if over:
            return
