"""What a run can be found by: its names, parameters and results as key and value."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from tactile_lab.errors import QuantityError
from tactile_lab.quantity import parse

if TYPE_CHECKING:
    from tactile_lab.store.summary import RunSummary

RESULTS = "results.json"
TEXTS = (
    "name", "status", "title", "protocol", "scene", "sensor", "operator", "bench",
    "started",
)  # fmt: skip
_QUANTITY = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?) (\S.*)")
_UNITS = ("N", "s", "V", "A", "T", "Hz", "K", "Ohm", "m")
"""Units that end the name of a result, such as critical_force_N."""
REST = "rest_V_C1"
_OF_TRIALS = (
    (REST, "", "rest_V_C1_V"),
    ("peak_rate", "", "peak_rate_Hz"),
    ("first_spike", "", "latency_s"),
    ("tau", "circuit_adaptation", "tau_s"),
    ("time_constant", "adaptation", "time_constant_s"),
)
"""Keys of the trials, unless the protocol concludes them: table of the trial, name."""
KNOWN: Mapping[str, str | None] = {
    **dict.fromkeys((*TEXTS, "tag", "note")),
    **dict.fromkeys(("starred", "simulated", "spikes"), ""),
    "duration": "s",
    **{key: name.rpartition("_")[2] for key, _, name in _OF_TRIALS},
}
"""Keys that may be asked for where no run has them, and their units; None of texts."""


class Fact(NamedTuple):
    """One thing that is known of a run.

    Attributes:
        key: such as "protocol.level" or "critical_force".
        number: SI; None for a text.
        text: as a person wrote it; "" for a number.
        unit: SI; "" without.
        trial: label of the trial it is of; "" of the run.
    """

    key: str
    number: float | None
    text: str = ""
    unit: str = ""
    trial: str = ""


def facts(entry: RunSummary) -> list[Fact]:
    """All that is known of a run, from its summary and its results; lists item by item.

    Results that cannot be read are left out: they can be written again.
    """
    found = [Fact(key, None, getattr(entry, key)) for key in TEXTS]
    found += [Fact("tag", None, tag) for tag in entry.tags]
    found += [Fact("note", None, note) for note in entry.notes]
    found.append(Fact("starred", float(entry.starred)))
    if entry.simulated is not None:
        found.append(Fact("simulated", float(entry.simulated)))
    if entry.duration is not None:
        found.append(Fact("duration", entry.duration, unit="s"))
    if entry.spikes is not None:
        found.append(Fact("spikes", float(entry.spikes)))
    for key, value in entry.parameters.items():
        if key != "name":
            found += _parameter(f"protocol.{key}", value)
    try:
        results = json.loads((entry.folder / RESULTS).read_text(encoding="utf-8"))
        found += of_results(results)
    except (OSError, ValueError, TypeError, AttributeError):
        return found
    return found


def grouped(found: Iterable[Fact]) -> dict[str, list[Fact]]:
    """The facts of one run by key."""
    table: dict[str, list[Fact]] = {}
    for fact in found:
        table.setdefault(fact.key, []).append(fact)
    return table


def quantity(text: str, unit: str) -> float:
    """A value to compare with: a number, SI, or a quantity in any prefix.

    Raises:
        QuantityError: it is in another unit.
    """
    try:
        return float(text)
    except ValueError:
        return parse(text, unit) if unit else _bare(text)


def _bare(text: str) -> float:
    if text in ("true", "false", "yes", "no"):
        return float(text in ("true", "yes"))
    raise QuantityError(f'"{text}" is no number; this has no unit.')


def _parameter(key: str, value: Any) -> Iterator[Fact]:
    if isinstance(value, list):
        for item in value:
            yield from _parameter(key, item)
    elif isinstance(value, bool | int | float):
        yield Fact(key, float(value))
    elif isinstance(value, str):
        for item in value.split(", "):  # older runs hold their lists as texts
            match = _QUANTITY.fullmatch(item)
            if match is None:
                yield Fact(key, None, item)
            else:
                yield Fact(key, float(match[1]), unit=match[2])


def of_results(results: Mapping[str, Any]) -> Iterator[Fact]:
    """The numbers that a run's results.json concludes, and those of its whole trials.

    A trial that was cut short has numbers of the part before, which compare with none.
    """
    concluded = list(_numbers(results.get("conclusion") or {}))
    yield from concluded
    told = {fact.key for fact in concluded}
    trials = results.get("trials") or []
    judged = any(trial.get("drift_V") is not None for trial in trials)
    for trial in trials:
        if trial.get("complete") is False:
            continue
        for key, table, name in _OF_TRIALS:
            if key == REST and not _rested(trial, judged):
                continue
            if key not in told:
                found = trial if not table else trial.get(table) or {}
                for fact in _number(key, found.get(name), name):
                    yield fact._replace(trial=str(trial.get("label") or ""))


def _rested(trial: Mapping[str, Any], judged: bool) -> bool:
    """Whether the sensor was at rest before a trial, and its probe on it.

    Where drift is judged in the run, that was of the trials it is told of. Else only of
    one without force: the others' V_GS was moved, or their probe. Older runs tell none.
    """
    if "drift_V" not in trial or trial["drift_V"] is not None:
        return True
    return not judged and trial.get("level_N") == 0


def _numbers(values: Mapping[str, Any]) -> Iterator[Fact]:
    for name, value in values.items():
        if isinstance(value, dict) and "value" not in value:
            yield from _numbers(value)
        elif isinstance(value, list):
            for one in value:
                yield from _number(name, one, name)
        else:
            yield from _number(name, value, name)


def _number(key: str, value: Any, name: str) -> Iterator[Fact]:
    """A result without the unit in its name; nothing where it is no number."""
    if isinstance(value, dict):
        value = value.get("value")
    if isinstance(value, bool) or not isinstance(value, int | float):
        return
    if not math.isfinite(value):
        return
    unit = name.rpartition("_")[2]
    known = unit if unit in _UNITS else ""
    yield Fact(key.removesuffix(f"_{known}") if known else key, float(value), "", known)
