"""What a run says as a whole: sentences, numbers, tables and files."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tactile_lab.analysis.error_budget import ErrorBudget, budget_line
from tactile_lab.analysis.estimate import Estimate

WIDTH = 100
"""Columns of a terminal that a table is fitted to."""
NOT_STATED = (
    "The bench states no uncertainty of force: none is carried into this number."
)
GEOMETRY_NOT_STATED = (
    "The bench states no uncertainty of Eq. (2)'s r, A1, A2 and B1: none is carried "
    "into this number."
)
NOT_SEARCHED = (
    "No result: spikes were not looked for. Put spikes into record.signals; that needs "
    "V_K (or V_C2, by its resets) on a channel."
)


@dataclass(frozen=True, kw_only=True)
class Table:
    """Headings and rows of text; first and last column stand left, the rest right.

    Attributes:
        title: stands above it.
        headings: one per column.
        rows: as many cells each as there are headings.
        note: stands below it.
    """

    title: str = ""
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""

    def __post_init__(self) -> None:
        """Refuse by TypeError what cannot be set in columns."""
        _check_texts("headings", self.headings)
        for row in self.rows:
            _check_texts("rows", row)
            if len(row) != len(self.headings):
                raise TypeError(
                    f"a table with {len(self.headings)} headings has the row {row!r}; "
                    "give it as many cells"
                )

    @property
    def text(self) -> str:
        """Aligned columns under headings, for a terminal; no trailing newline.

        What is too long for the last column goes on below.
        """
        widths = [
            max(len(cell) for cell in column)
            for column in zip(self.headings, *self.rows, strict=True)
        ]
        before = sum(widths[:-1]) + 2 * len(widths[:-1])
        room = max(WIDTH - before, len(self.headings[-1]))
        widths[-1] = min(widths[-1], room)
        lines = [self._line(self.headings, widths)]
        lines.append("  ".join("─" * width for width in widths))
        for row in self.rows:
            first, *more = textwrap.wrap(row[-1], room) or [""]
            lines.append(self._line((*row[:-1], first), widths))
            lines.extend(" " * before + part for part in more)
        return "\n".join(lines)

    def _line(self, cells: tuple[str, ...], widths: list[int]) -> str:
        last = len(cells) - 1
        padded = [
            cell.ljust(width) if i in (0, last) else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        return "  ".join(padded).rstrip()


@dataclass(frozen=True)
class Conclusion:
    """What a run says as a whole; two are joined by ``+``.

    Attributes:
        sentences: for people.
        values: for machines, by name with the unit in it ("critical_force_N"): plain
            values, or an `Estimate`, which brings its uncertainty along.
        missing: what the run was for and does not tell, and why, one sentence each.
        tables: for people, too.
        files: texts to be kept in the run's folder, by name. One that is there already
            stays, and none is ever changed.
        budgets: what each cause of uncertainty contributes to its numbers, by what of.
    """

    sentences: tuple[str, ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    budgets: Mapping[str, ErrorBudget] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse by TypeError what neither terminal nor page can show."""
        _check_texts("sentences", self.sentences)
        _check_texts("missing", self.missing)
        for table in self.tables:
            if not isinstance(table, Table):
                raise TypeError(f"tables hold {table!r}; make it a Table")
        for budget in self.budgets.values():
            if not isinstance(budget, ErrorBudget):
                raise TypeError(f"budgets hold {budget!r}; make it an ErrorBudget")

    def __add__(self, other: Conclusion) -> Conclusion:
        """Both, one after the other."""
        return Conclusion(
            (*self.sentences, *other.sentences),
            {**self.values, **other.values},
            (*self.missing, *other.missing),
            (*self.tables, *other.tables),
            {**self.files, **other.files},
            {**self.budgets, **other.budgets},
        )

    @property
    def text(self) -> str:
        """Sentences and tables, an empty line between them, for a terminal."""
        tables = (
            "\n".join(part for part in (t.title, t.text, t.note) if part)
            for t in self.tables
        )
        parts = ("\n".join(self.sentences), *tables)
        return "\n\n".join(part for part in parts if part)

    @property
    def budget_line(self) -> str:
        """The error budgets as one line; "" without any."""
        return budget_line(self.budgets, "Error budget (95 % or bound)")

    @property
    def plain(self) -> dict[str, Any]:
        """`values` as JSON takes them: what is no number is null.

        Raises:
            TypeError: a value that is neither number, text, estimate nor a list or
                table of them.
        """
        return {str(name): _plain(value) for name, value in self.values.items()}


def _check_texts(what: str, found: Iterable[str]) -> None:
    if isinstance(found, str) or not all(isinstance(one, str) for one in found):
        raise TypeError(f"{what} must be a tuple of texts, not {found!r}")


def _plain(value: Any) -> Any:
    if isinstance(value, Estimate):
        value = value.to_dict()
    if isinstance(value, Mapping):
        return {str(name): _plain(one) for name, one in value.items()}
    if hasattr(value, "tolist"):  # of numpy, which is not imported for this
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, str | int | float):
        return value
    if isinstance(value, Iterable):
        return [_plain(one) for one in value]
    raise TypeError(
        f"a conclusion's values hold {value!r}; numbers, texts, estimates, and lists "
        "and tables of them are possible"
    )
