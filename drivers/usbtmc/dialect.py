"""How one model of USBTMC oscilloscope speaks, as a row of data (TOML)."""

from __future__ import annotations

import difflib
import tomllib
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from tactile_lab.errors import SceneError


def _frozen(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


Lines = Annotated[tuple[str, ...], BeforeValidator(_frozen)]
Numbers = Annotated[tuple[float, ...], BeforeValidator(_frozen)]


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Timebases(_Strict):
    """Horizontal scales, s a division, in steps of 1, 2, 5."""

    shortest: float = Field(gt=0)
    longest: float = Field(gt=0)


class Commands(_Strict):
    """Lines and questions; names in braces are filled in.

    `{input}` is an input's name, `{scale}` V a division, `{offset}` V, `{coupling}` DC
    or AC, `{depth}` samples, `{timebase}` s a division, `{first}` and `{last}` sample
    numbers from 1. `rate` answers S/s, `status` a word of which `waiting` and `done`
    matter, `preamble` the ten numbers of a Rigol, `data` a block of bytes.
    """

    identify: str
    error: str
    input_off: Lines
    input_on: Lines
    acquire: Lines
    rate: str
    arm: Lines
    status: str
    waiting: str
    done: str
    force: str
    stop: Lines
    select: Lines
    preamble: str
    bounds: Lines
    data: str


class ScopeDialect(_Strict):
    """One model.

    Attributes:
        id, title: for scenes and for people.
        match: pattern that its answer to `identify` begins with.
        vendor, product: USB ids.
        header_once: see `UsbtmcLink`.
        inputs: names of its inputs.
        fastest: highest rate for 1, 2, ... enabled inputs, S/s.
        bits: of its converter.
        divisions_wide: of the screen.
        divisions_high: from the middle of the screen to its edge: the full scale.
        codes_per_division: steps of the converter.
        scales: V a division.
        timebases: s a division.
        depth: samples of a record for 1, 2, ... enabled inputs.
        read_at_once: most samples of one answer.
        commands: what to say.
    """

    id: str
    title: str
    match: str
    vendor: int = Field(ge=0, le=0xFFFF)
    product: int = Field(ge=0, le=0xFFFF)
    header_once: bool = False
    inputs: Lines
    fastest: Numbers
    bits: int = Field(ge=1, le=8)
    divisions_wide: int = Field(ge=1)
    divisions_high: int = Field(ge=1)
    codes_per_division: int = Field(ge=1)
    scales: Numbers
    timebases: Timebases
    depth: dict[int, int]
    read_at_once: int = Field(ge=1)
    commands: Commands

    @property
    def ranges(self) -> tuple[float, ...]:
        """Full scale of each vertical scale, V."""
        return tuple(float(f"{s * self.divisions_high:.6g}") for s in self.scales)

    def timebase(self, interval: float, inputs: int) -> float:
        """The longest s a division that samples at least as often as wanted.

        Args:
            interval: wanted time between samples, s.
            inputs: how many are enabled.
        """
        wanted = self.depth[inputs] * interval / self.divisions_wide
        step = self.timebases.shortest
        for exponent in range(-12, 4):
            for mantissa in (1, 2, 5):
                candidate = float(f"{mantissa}e{exponent}")
                if step <= candidate <= wanted * (1 + 1e-9):
                    step = candidate
        return min(step, self.timebases.longest)


class _File(_Strict):
    row: ScopeDialect


@cache
def _shipped() -> dict[str, ScopeDialect]:
    folder = resources.files("drivers") / "scope_dialects"
    rows = [
        parse(entry.read_text(encoding="utf-8"), entry.name)
        for entry in folder.iterdir()
        if entry.name.endswith(".toml")
    ]
    return {row.id: row for row in rows}


def scope_dialect_ids() -> tuple[str, ...]:
    """Ids of the rows that ship, sorted."""
    return tuple(sorted(_shipped()))


def load_scope_dialect(name: str) -> ScopeDialect:
    """The row called `name`: an id, or the path of a TOML file.

    Raises:
        SceneError: no such row (the nearest is named), or a row with a mistake.
    """
    if name.endswith(".toml"):
        try:
            return parse(Path(name).read_text(encoding="utf-8"), name)
        except (OSError, UnicodeDecodeError) as reason:
            raise SceneError(
                f"Scope dialect {name} cannot be read: {reason}"
            ) from reason
    rows = _shipped()
    if name not in rows:
        near = difflib.get_close_matches(name, rows, n=1, cutoff=0.3)
        hint = f'did you mean "{near[0]}"? ' if near else ""
        raise SceneError(
            f'There is no scope dialect "{name}"; {hint}'
            f"Known: {', '.join(sorted(rows))}. A path ending in .toml names "
            "a row of your own."
        )
    return rows[name]


def parse(text: str, where: str) -> ScopeDialect:
    """The row written in `text`.

    Raises:
        SceneError: not TOML, or not a row; names `where` and the key.
    """
    try:
        return _File.model_validate(tomllib.loads(text)).row
    except tomllib.TOMLDecodeError as reason:
        raise SceneError(f"Scope dialect {where} is not TOML: {reason}.") from reason
    except ValidationError as reason:
        problems = "; ".join(
            f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in reason.errors()
        )
        raise SceneError(f"Scope dialect {where} has mistakes: {problems}.") from reason
