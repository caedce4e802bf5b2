"""Braille cells: which of the six dots each letter, digit and sign raises."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import SceneError

FIRST_TEN = ("1", "12", "14", "145", "15", "124", "1245", "125", "24", "245")
"""Dots of a to j; k to t add dot 3, u to z but w add 3 and 6; w came later."""
LETTERS = {
    **dict(zip("abcdefghij", FIRST_TEN, strict=True)),
    **{k: d + "3" for k, d in zip("klmnopqrst", FIRST_TEN, strict=True)},
    **{k: d + "36" for k, d in zip("uvxyz", FIRST_TEN, strict=False)},
    "w": "2456",
    " ": "",
}
NUMBER_SIGN = "3456"


def dots(text: str) -> NDArray[np.int64]:
    """Cell, column and row of each raised dot of a text, shape (n, 3).

    Digits are a to j after the sign for numbers; capitals are written small.

    Raises:
        SceneError: a character has no cell here, or the text raises no dot.
    """
    cells: list[str] = []
    number = False
    for character in text.lower():
        digit = character in "0123456789"
        if digit and not number:
            cells.append(NUMBER_SIGN)
        number = digit
        letter = "jabcdefghi"[int(character)] if digit else character
        if letter not in LETTERS:
            raise SceneError(
                f'text: "{character}" has no braille cell here; letters a to z, digits '
                "and spaces have"
            )
        cells.append(LETTERS[letter])
    found = [
        (cell, (int(dot) - 1) // 3, (int(dot) - 1) % 3)
        for cell, raised in enumerate(cells)
        for dot in raised
    ]
    if not found:
        raise SceneError("text raises no dot; write letters or digits")
    return np.array(found)
