"""Answers that a pattern of a dialect row accepts, made from the pattern itself."""

from __future__ import annotations

import re
from re import _parser  # type: ignore[attr-defined]
from typing import Any

from tactile_lab.errors import SceneError

_BY_CATEGORY = {
    "CATEGORY_DIGIT": "1",
    "CATEGORY_NOT_DIGIT": "x",
    "CATEGORY_SPACE": " ",
    "CATEGORY_NOT_SPACE": "x",
    "CATEGORY_WORD": "x",
    "CATEGORY_NOT_WORD": " ",
}


def invented(pattern: str, number: str | None = None) -> str:
    """The shortest text of the first kind that `pattern` finds.

    Args:
        pattern: of a row.
        number: what group 1 shall be.

    Raises:
        SceneError: no such text could be made.
    """
    text = _text(_parser.parse(pattern), number).strip()
    found = re.search(pattern, text)
    if found is None or (number is not None and found.group(1) != number):
        raise SceneError(
            f"No simulated answer can be made from the pattern {pattern!r}; it gives "
            f"{text!r}. Write a simpler pattern, or simulate the model in "
            "sim_backend/."
        )
    return text


def _text(tree: Any, number: str | None) -> str:
    return "".join(_part(str(kind), value, number) for kind, value in tree)


def _part(kind: str, value: Any, number: str | None) -> str:
    text = ""  # places and look-arounds have no text of their own
    match kind:
        case "LITERAL":
            text = chr(value)
        case "ANY" | "NOT_LITERAL":
            text = "x"
        case "IN":
            text = _one_of(value)
        case "BRANCH":
            text = _text(value[1][0], number)
        case "SUBPATTERN" if value[0] == 1 and number is not None:
            text = number
        case "SUBPATTERN":
            text = _text(value[3], number)
        case "MAX_REPEAT" | "MIN_REPEAT":
            least, _, tree = value
            text = _text(tree, number) * least
    return text


def _one_of(choices: Any) -> str:
    kind, value = str(choices[0][0]), choices[0][1]
    if kind == "RANGE":
        return chr(value[0])
    if kind == "CATEGORY":
        return _BY_CATEGORY[str(value)]
    return "x" if kind == "NEGATE" else chr(value)
