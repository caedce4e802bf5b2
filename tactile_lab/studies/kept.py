"""What a study keeps of each point: an expression of its run, or a user's function."""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

from tactile_lab.errors import ParameterError, SceneError, choices, fault_in
from tactile_lab.spikes.trains import Trains
from tactile_lab.studies.column import Column, Rows, Value

OF_TRAINS: Mapping[str, Callable[[Trains], Column]] = {
    "spike_count": lambda trains: trains.count.astype(np.float64),
    "spike_times": lambda trains: Rows(trains.times, trains.count),
    "first_spike": lambda trains: trains.first,
    "last_spike": lambda trains: trains.last,
    "mean_rate": lambda trains: trains.mean_rate,
}
"""Names that stand for something of the spikes, computed for many points at once."""
CRITICAL_FORCE = "critical_force(circuit)"
NAMED = {
    "spike_count": ("spike_count", ""),
    "spike_times": ("spike_times", "s"),
    "first_spike": ("first_spike", "s"),
    "last_spike": ("last_spike", "s"),
    "mean_rate": ("mean_rate", "Hz"),
    "critical_force": (CRITICAL_FORCE, "N"),
}
"""Names that stand for one of these or an expression, and its unit."""
OF_A_POINT = frozenset({"result", "run", "answer", "circuit", "scene"})
"""What an expression may use of a point beside its spikes and the force."""
_ALWAYS = frozenset({"spikes", "circuit", "scene", "critical_force", "np", "nan"})
USABLE = {
    "model": _ALWAYS | {"result", "force"},
    "simulated": _ALWAYS | {"run", "answer"},
    "bench": _ALWAYS | {"run", "answer"},
}
"""Names that an expression may use, by what a study is computed on."""
_FUNCTION = re.compile(r"(?P<file>.+\.py):(?P<function>[A-Za-z_][A-Za-z0-9_]*)")


@dataclass(frozen=True)
class Kept:
    """One thing that is kept of each point.

    Attributes:
        name: of its column.
        expression: one of `OF_TRAINS`; or Python, with the names that a point gives;
            or ``file.py:function``, called with the point's run (or model's result).
        source: the text of the function's file; "" for an expression.
        unit: SI; "" where it has none, or only its author knows it.
    """

    name: str
    expression: str
    source: str = ""
    unit: str = ""

    @property
    def of_spikes(self) -> bool:
        """Whether a point's spikes and force are all it needs."""
        return not OF_A_POINT & self._used

    @property
    def uses_spikes(self) -> bool:
        """Whether it is told from the spikes that were found."""
        return "spikes" in self._used

    @property
    def uses_scene(self) -> bool:
        """Whether it looks at the scene itself."""
        return "scene" in self._used

    @property
    def _used(self) -> frozenset[str]:
        """Names of a point that it looks up; a function is given the run or result."""
        if self.source:
            return frozenset({"run", "result"})
        if self.expression in OF_TRAINS:
            return frozenset({"spikes"})
        return frozenset(_names(_compiled(self.name, self.expression)))

    @property
    def needs_times(self) -> bool:
        """Whether number, first and last of the spikes are not enough."""
        short = {*OF_TRAINS, CRITICAL_FORCE} - {"spike_times"}
        return self.expression not in short

    def of(self, names: Mapping[str, Any]) -> Value:
        """The value at a point: a number, or a row of numbers (shape (n,)).

        Raises:
            ParameterError: the expression or function fails, or gives something else.
        """
        try:
            if self.expression in OF_TRAINS:
                column = OF_TRAINS[self.expression](Trains.of_one(names["spikes"]))
                value = column.values if isinstance(column, Rows) else column[0]
            elif self.source:
                value = _function(self)(names.get("run", names.get("result")))
            else:
                # the study's author wrote it, as they write protocols in Python
                code = _compiled(self.name, self.expression)
                value = eval(code, dict(names))
            if isinstance(value, Mapping) and "value" in value:
                value = value["value"]  # of `answer`: its interval is beside it
            array = np.asarray(value, dtype=np.float64)
        except Exception as error:  # whatever a user's expression raises
            where = self.expression.rpartition(":")[0] if self.source else ""
            raise ParameterError(f"{self.name}: {fault_in(where, error)}") from error
        if array.ndim > 1:
            raise ParameterError(
                f"{self.name} = {self.expression} has the shape {array.shape}; a "
                "number or one row of numbers can be kept."
            )
        return float(array) if array.ndim == 0 else array


@cache
def _compiled(name: str, expression: str) -> CodeType:
    return compile(expression, f"keep.{name}", "eval")


def _names(code: CodeType) -> set[str]:
    """All names that a piece of Python looks up, in its lambdas, too."""
    inner = (one for one in code.co_consts if isinstance(one, CodeType))
    return set(code.co_names).union(*map(_names, inner))


@cache
def _function(kept: Kept) -> Callable[[Any], Any]:
    path, _, name = kept.expression.rpartition(":")
    module: dict[str, Any] = {"__name__": Path(path).stem, "__file__": path}
    exec(compile(kept.source, path, "exec"), module)
    found = module.get(name)
    if not callable(found):
        raise SceneError(f"{path} has no function {name}.")
    called: Callable[[Any], Any] = found
    return called


def kept(
    asked: tuple[str, ...] | Mapping[str, str], folder: Path, on: str
) -> tuple[Kept, ...]:
    """What a study asks to keep: names of `NAMED`, or expressions by name.

    Args:
        asked: names, or expression (or ``file.py:function``) by name.
        folder: what files are relative to.
        on: what the study is computed on.

    Raises:
        SceneError: no such name, an expression that is not Python or uses a name
            that is not there, no such file.
    """
    if not asked:
        raise SceneError("keep is empty: a study that keeps nothing computes nothing.")
    pairs = asked if isinstance(asked, Mapping) else {name: name for name in asked}
    return tuple(_kept(name, text, folder, on) for name, text in pairs.items())


def _kept(name: str, text: str, folder: Path, on: str) -> Kept:
    if not name.isidentifier():
        raise SceneError(f'keep: "{name}" is no name; use letters, digits and _.')
    function = _FUNCTION.fullmatch(text)
    if function is not None:
        path = (folder / function["file"]).resolve()
        try:
            source = path.read_text(encoding="utf-8")
        except (OSError, ValueError) as reason:
            raise SceneError(
                f"keep.{name}: {path} cannot be read: {reason}."
            ) from reason
        return Kept(name, f"{path}:{function['function']}", source)
    if text.isidentifier() and text not in NAMED:
        raise SceneError(f'keep has no "{text}"; {choices(text, NAMED)}')
    expression, unit = NAMED.get(text, (text, ""))
    if expression in OF_TRAINS:
        return Kept(name, expression, unit=unit)
    try:
        _compiled(name, expression)
    except (SyntaxError, ValueError) as reason:
        raise SceneError(
            f'keep.{name} = "{text}" is no Python expression: {reason}.'
        ) from reason
    for used in _free(expression):
        if used not in USABLE[on] and not hasattr(builtins, used):
            told = choices(used, sorted(USABLE[on]), f'With on = "{on}" there are')
            raise SceneError(f'keep.{name} = "{text}": there is no {used}; {told}')
    return Kept(name, expression, unit=unit)


def _free(expression: str) -> list[str]:
    """Names that an expression takes from outside, in their order."""
    nodes = list(ast.walk(ast.parse(expression.strip(), mode="eval")))
    names = [one for one in nodes if isinstance(one, ast.Name)]
    own = {one.id for one in names if isinstance(one.ctx, ast.Store)}
    own |= {one.arg for one in nodes if isinstance(one, ast.arg)}
    return [one.id for one in names if one.id not in own]
