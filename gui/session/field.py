"""Reading the field on request, in a thread of the window."""

from __future__ import annotations

from queue import SimpleQueue

from gui.session.messages import FieldByHand, Told
from gui.session.threads import start
from tactile_lab.bench import Bench
from tactile_lab.errors import TactileLabError
from tactile_lab.quantity import show


def read_in_background(bench: Bench, inbox: SimpleQueue[Told]) -> None:
    """Read the field a few times."""

    def work() -> None:
        from tactile_lab.acquisition.by_hand import read_field

        try:
            found = read_field(bench)
        except (TactileLabError, OSError) as error:
            inbox.put(FieldByHand(None, f"The field was not read: {error}"))
        else:
            text = f"{show(found.mean, 'T', 4)} ± {show(found.spread, 'T', 2)}"
            inbox.put(FieldByHand(found.mean, f"Field {text}"))

    start(work, "read field")
