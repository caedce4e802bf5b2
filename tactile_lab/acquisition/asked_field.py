"""The field as a person reads it off a teslameter that has no output of any kind."""

from __future__ import annotations

from collections.abc import Callable

from tactile_lab.acquisition.person import Question
from tactile_lab.errors import QuantityError, RefusedError
from tactile_lab.magnetics import ROUGH
from tactile_lab.quantity import parse, show

MOST = 3.0
"""Largest field that can be meant, T: the 516 62 shows up to 2 T."""

NOTABLE = 1e-3
"""Difference from what is expected that is never remarked on, T."""


class AskedField:
    """Asks for the field and does not believe everything.

    What differs much from what is expected has to be typed twice. At first that is what
    the bench file makes of the current, then what the readings so far make of it.

    Args:
        ask: puts a question and returns what was typed.
        expected: field at a current, T at A.
        patient: ask again; else what cannot be a reading is refused, and what is not
            expected is taken with a doubt.
    """

    def __init__(
        self, ask: Question, expected: Callable[[float], float], *, patient: bool = True
    ) -> None:
        self._ask = ask
        self._expected = expected
        self._patient = patient
        self._learnt = 1.0

    def read(self, current: float) -> tuple[float, str | None]:
        """The field at `current` (A), T, and what is doubtful about it.

        Raises:
            RefusedError: not a field, and nobody to be asked again.
        """
        question = f"Type the field that the teslameter shows at {show(current, 'A')}"
        before = ""
        doubted: float | None = None
        while True:
            answer = self._ask(f"{before}{question}, in mT.")
            try:
                field = read_off(answer)
            except QuantityError as reason:
                if not self._patient:
                    raise RefusedError(str(reason)) from reason
                before = f"{reason}\n"
                continue
            doubt = self._doubt(field, current)
            if doubt is None or not self._patient or field == doubted:
                if abs(self._expected(current)) > NOTABLE:
                    self._learnt = field / self._expected(current)
                return field, None if self._patient else doubt
            doubted, before = field, f"{doubt} Type it again if it is right.\n"

    def _doubt(self, field: float, current: float) -> str | None:
        expected = self._learnt * self._expected(current)
        low, high = sorted((expected / ROUGH, expected * ROUGH))
        if low - NOTABLE <= field <= high + NOTABLE:
            return None
        return (
            f"{show(field, 'T')} at {show(current, 'A')} is not the "
            f"{show(expected, 'T')} expected: check sign, range and unit."
        )


def read_off(answer: str) -> float:
    """The field typed as `answer`, T: mT unless it has another unit.

    Raises:
        QuantityError: no field, or more than any of these meters shows.
    """
    text = answer.strip()
    try:
        field = parse(f"{float(text.replace('−', '-'))!r} mT", "T")
    except ValueError:
        field = parse(text, "T")
    if abs(field) > MOST:
        raise QuantityError(
            f"{show(field, 'T')} is more than a teslameter shows; the number is "
            "in mT unless a unit follows it."
        )
    return field
