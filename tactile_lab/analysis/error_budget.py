"""What each cause of uncertainty contributes to a number; a line in a report's head."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tactile_lab.quantity import rounded, show


@dataclass(frozen=True)
class ErrorBudget:
    """Half-widths of 95 % bands, or bounds, by cause.

    Attributes:
        unit: of all values, SI; "" of a factor.
        parts: by the name of the cause; None where nobody has stated the cause's size.
        bound: all together, where they do not add as squares.
    """

    unit: str
    parts: Mapping[str, float | None]
    bound: float | None = None

    @property
    def whole(self) -> float:
        """All that is stated, together."""
        if self.bound is not None:
            return self.bound
        return math.sqrt(sum(part**2 for part in self.parts.values() if part))

    @property
    def text(self) -> str:
        """For a person: "±1.2 ms = clocks 0.5 ms, ...; force not stated"."""
        told = {
            name: part for name, part in self.parts.items() if part and part > 1e-18
        }
        silent = [name for name, part in self.parts.items() if part is None]
        text = f"±{self._shown(self.whole)}"
        if told:
            parts = (f"{name} {self._shown(part)}" for name, part in told.items())
            text += f" = {', '.join(parts)}"
        return text + (f"; {', '.join(silent)} not stated" if silent else "")

    def _shown(self, size: float) -> str:
        return show(size, self.unit, 2) if self.unit else rounded(size)

    @property
    def plain(self) -> dict[str, Any]:
        """For machines."""
        return {"unit": self.unit, "whole": self.whole, **self.parts}


def budget_line(budgets: Mapping[str, ErrorBudget], of: str) -> str:
    """Budgets by what they are of, as one line; "" without any."""
    told = ". ".join(f"{what} {budget.text}" for what, budget in budgets.items())
    return f"{of}: {told}." if told else ""
