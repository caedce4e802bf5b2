"""How many bytes a part of a run takes in formats that pack it, before it is packed."""

from __future__ import annotations

from collections.abc import Callable

from tactile_lab.store.export.content import about, tables
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection

PROBES, PROBED = 4, 1 << 18
"""Stretches that are packed to see what the whole takes, and rows of each: formats pack
no more together."""
MARGIN = 1.2
"""What is told over what the stretches took: others may be harder to pack."""
COLUMN = 2_000
"""Bytes that HDF5 takes for a column of a table beside its values."""


def signals(run: Run, selection: Selection, pack: Callable[[Selection], int]) -> int:
    """Bytes that the signals will take, rather fewer, as stretches of them tell.

    How much compression leaves depends on the run: a twentieth of one that rests.

    Args:
        run: what is exported.
        selection: the part of it.
        pack: packs a part, and tells the bytes it took.
    """
    rows, taken, whole = 0, 0, selection.rows(run)
    for probe in selection.stretches(run, PROBES, PROBED):
        taken += pack(probe)
        rows += probe.rows(run)
    return taken if rows >= whole else int(MARGIN * taken * whole / rows)


def listed(run: Run, selection: Selection) -> int:
    """Bytes that the tables take, and what is told of the run, in one HDF5 file."""
    columns = (table.columns for table in tables(run, selection).values())
    rows = sum(it.nbytes + COLUMN for each in columns for it in each.values())
    return rows + told(run, selection)


def told(run: Run, selection: Selection) -> int:
    """Bytes of what is told of the run."""
    return sum(len(str(text).encode()) for text in about(run, selection).values())
