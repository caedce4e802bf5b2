"""What a run says as a whole."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

NO_UNCERTAINTY = (
    "The calibration states no uncertainty of force: none is carried into this number."
)


@dataclass(frozen=True)
class Conclusion:
    """What a run says as a whole.

    Attributes:
        sentences: for people.
        values: for machines, plain values with units in the keys.
        missing: what the run was for and does not tell, and why, one sentence each.
    """

    sentences: tuple[str, ...] = ()
    values: dict[str, Any] = field(default_factory=dict)
    missing: tuple[str, ...] = ()

    def __add__(self, other: Conclusion) -> Conclusion:
        """Both, one after the other."""
        return Conclusion(
            (*self.sentences, *other.sentences),
            {**self.values, **other.values},
            (*self.missing, *other.missing),
        )
