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
    """

    sentences: tuple[str, ...] = ()
    values: dict[str, Any] = field(default_factory=dict)
