"""Reading files that scenes and benches name: text, and numeric columns."""

from __future__ import annotations

import csv
import io
import math
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_lab.errors import SceneError

if TYPE_CHECKING:
    from tactile_lab.arrays import FloatArray

LARGEST_FILE = 256 * 2**20
"""Bytes; a scene's force table may be long, but not endless."""


def read_text(path: Path, what: str = "File") -> str:
    """The text of a UTF-8 file.

    Raises:
        SceneError: missing, a folder, not readable, too large, or not text.
    """
    try:
        if stat.S_ISFIFO(path.stat().st_mode):
            raise SceneError(f"{what} {path} is a pipe; a file is needed.")
        with path.open("rb") as file:
            raw = file.read(LARGEST_FILE + 1)
    except FileNotFoundError as reason:
        raise SceneError(f"{what} {path} does not exist.") from reason
    except IsADirectoryError as reason:
        raise SceneError(f"{what} {path} is a folder; a file is needed.") from reason
    except (OSError, ValueError) as reason:
        told = getattr(reason, "strerror", None) or reason
        raise SceneError(f"{what} {path} cannot be read: {told}.") from reason
    if len(raw) > LARGEST_FILE:
        raise SceneError(f"{what} {path} is larger than {LARGEST_FILE >> 20} MiB.")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        raise SceneError(
            f"{what} {path} is not text (UTF-8): byte {reason.start} cannot be read."
        ) from reason
    if not text.strip():
        raise SceneError(f"{what} {path} is empty.")
    return text


def read_cells(path: Path) -> Iterator[tuple[int, list[str]]]:
    """(line number, cells) of a CSV file; empty lines and those with # are left out.

    Raises:
        SceneError: not readable, or no CSV; the line is named.
    """
    reader = csv.reader(io.StringIO(read_text(path), newline=""), skipinitialspace=True)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells) and not cells[0].startswith("#"):
                yield reader.line_num, cells
    except csv.Error as reason:
        raise SceneError(f"{path}, line {reader.line_num}: {reason}.") from reason


def read_columns(
    path: Path, headers: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], FloatArray, Sequence[int]]:
    """Numeric columns of a CSV file.

    Args:
        path: the file; lines that are empty or start with # are passed over.
        headers: allowed headers; the first line must be one of them.

    Returns:
        The header found, an array of shape (rows, columns), and each row's line number.

    Raises:
        SceneError: not readable, another header, a row of another length, or a value
            that is not a finite number; the line is named.
    """
    import numpy as np  # heavy, and most read texts alone

    if (whole := _plain_columns(path, headers)) is not None:
        return whole
    wanted = " or ".join(",".join(names) for names in headers)
    header: tuple[str, ...] | None = None
    rows: list[list[float]] = []
    lines: list[int] = []
    for line, cells in read_cells(path):
        at = f"{path}, line {line}"
        if header is None:
            header = tuple(cells)
            if header not in headers:
                raise SceneError(
                    f'{at}: the header is "{",".join(cells)[:60]}"; it must be '
                    f"{wanted}."
                )
            continue
        rows.append(_numbers(cells, header, at))
        lines.append(line)
    if header is None or not rows:
        raise SceneError(f"{path} holds no rows under the header {wanted}.")
    return header, np.array(rows, dtype=np.float64), lines


def _plain_columns(
    path: Path, headers: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], FloatArray, Sequence[int]] | None:
    """The same of a file of numbers and nothing else, a hundred times as fast.

    None where anything else is in it, which `read_columns` then finds or passes over.
    """
    import numpy as np

    text = read_text(path)
    first, _, rest = text.partition("\n")
    header = tuple(cell.strip() for cell in first.split(","))
    odd = "#" in text or '"' in text or "\n\n" in text or "\r" in text
    if header not in headers or odd or not rest.strip():
        return None
    try:
        rows = np.loadtxt(io.StringIO(rest), delimiter=",", ndmin=2)
    except ValueError:
        return None
    if rows.shape[1] != len(header) or not np.isfinite(rows).all():
        return None
    return header, rows, range(2, 2 + len(rows))


def _numbers(cells: list[str], header: tuple[str, ...], at: str) -> list[float]:
    if len(cells) != len(header):
        raise SceneError(
            f"{at}: {len(cells)} values where {len(header)} are needed "
            f"({','.join(header)})."
        )
    row = []
    for name, cell in zip(header, cells, strict=True):
        try:
            number = float(cell)
        except ValueError as reason:
            raise SceneError(
                f'{at}: {name} is "{cell[:40]}", not a number.'
            ) from reason
        if not math.isfinite(number):
            raise SceneError(f"{at}: {name} is {cell}; give a finite number.")
        row.append(number)
    return row
