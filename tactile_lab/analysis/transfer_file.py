"""Reading a transfer curve: our own CSV, or what a parameter analyser exports."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.columns import read_cells
from tactile_lab.errors import SceneError

VOLTAGE = ("v_gs_v", "v_gs", "vgs", "vg", "vgate", "gatev")
CURRENT = ("i_ds_a", "i_ds", "ids", "id", "idrain", "draini")
"""Names of the columns, in small letters: ours, EasyEXPERT's usual ones, Keithley's."""
NAMES, VALUES = "dataname", "datavalue"
"""First cells of EasyEXPERT's line of names and of its lines of values."""
NO_NUMBER = 9e37
"""SCPI instruments send 9.9e37 for an overflow and 9.91e37 for no number."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A transfer curve as read.

    Attributes:
        V_GS: V.
        I_DS: A.
        left_out: lines of the file that held no number, or an instrument's sign for
            none.
    """

    V_GS: FloatArray
    I_DS: FloatArray
    left_out: tuple[int, ...]


def read_transfer(path: Path) -> Curve:
    """The curve in a CSV whose header names V_GS and I_DS; SI units.

    Lines before the header (an analyser's settings), empty ones, those that begin with
    # and columns of other names are passed over. Rows with NaN, an infinity, or what
    SCPI instruments send for them (9.9e37 and 9.91e37) are left out.

    Raises:
        SceneError: no such header, no row, or a cell that is no number; the line is
            named.
    """
    columns: tuple[int, int] | None = None
    analyser = False
    rows: list[tuple[float, float]] = []
    left_out: list[int] = []
    for line, cells in read_cells(path):
        if columns is None:
            columns = _columns(cells)
            analyser = cells[0].lower() == NAMES
            continue
        if analyser and cells[0].lower() != VALUES:
            continue  # the next sweep's settings
        at = f"{path}, line {line}"
        pair = (_number(cells, columns[0], at), _number(cells, columns[1], at))
        if all(abs(value) < NO_NUMBER for value in pair):
            rows.append(pair)
        else:
            left_out.append(line)
    if columns is None:
        raise SceneError(
            f"{path} has no line that names V_GS and I_DS, such as V_GS_V,I_DS_A or "
            "VG,ID."
        )
    volts, amperes = np.array(rows, dtype=np.float64).reshape(-1, 2).T
    return Curve(volts, amperes, tuple(left_out))


def _columns(cells: list[str]) -> tuple[int, int] | None:
    """Where the voltage and the current stand, if these are their names."""
    small = [cell.lower() for cell in cells]
    volts = [small.index(name) for name in VOLTAGE if name in small]
    amperes = [small.index(name) for name in CURRENT if name in small]
    return (volts[0], amperes[0]) if volts and amperes else None


def _number(cells: list[str], column: int, at: str) -> float:
    text = cells[column] if column < len(cells) else ""
    if not text:
        return math.nan
    try:
        return float(text)
    except ValueError as reason:
        raise SceneError(f'{at}: "{text[:40]}" is not a number.') from reason
