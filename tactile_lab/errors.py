"""The one error tree. Every leaf is also a builtin exception.

TactileLabError
├── SceneError            (ValueError)
│   └── QuantityError     (ValueError)
├── LimitError            (ValueError)
├── ParameterError        (ValueError)
├── SolverError           (ArithmeticError)
├── InstrumentError       (OSError)
│   ├── NotFoundError     (FileNotFoundError)
│   ├── LinkLostError     (ConnectionError)
│   ├── NoReplyError      (TimeoutError)
│   ├── BadReplyError     (ValueError)
│   ├── RefusedError      (RuntimeError)
│   ├── SamplesLostError  (RuntimeError)
│   └── SurplusError      (RuntimeError)
├── InterlockError        (RuntimeError)
├── HaltedError           (RuntimeError)
├── UnsafeError           (RuntimeError)
├── RecordingError        (OSError)
├── RunFolderError        (ValueError)
└── NotIdentifiableError  (ValueError)

A message says what, value, unit, limit, and what to do.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

LONGEST = 300
"""Characters of a foreign error's text that are told: a KeyError repeats its key."""


def to_type(*words: object) -> str:
    """A command of this program for a message to tell, quoted as a shell takes it."""
    import shlex

    return shlex.join(["tactile-lab", *map(str, words)])


def fault_in(file: str | Path, error: BaseException) -> str:
    """Kind and text of an error, and where in a user's file it came from, if it did."""
    import traceback
    from pathlib import Path

    told = f"{type(error).__name__}: {error}".removesuffix(": ")
    told = told if len(told) <= LONGEST else f"{told[:LONGEST]} ..."
    frames = traceback.extract_tb(error.__traceback__)
    line = next((f.lineno for f in reversed(frames) if f.filename == str(file)), None)
    return told if line is None else f"{Path(file).name}, line {line}: {told}"


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint such as ``did you mean "hold"?``, or an empty text if nothing is near."""
    import difflib

    folded = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower(), folded, n=1, cutoff=0.55)
    return f'did you mean "{folded[near[0]]}"?' if near else ""


def choices(word: str, known: Iterable[str], called: str = "Known") -> str:
    """The nearest of what is known, and all of it, such as ``Known: a, b.``."""
    names = list(known)
    hint = nearest(word, names)
    return f"{hint}{' ' if hint else ''}{called}: {', '.join(names) or 'none'}."


class TactileLabError(Exception):
    """Root of every error this program raises on purpose."""


class SceneError(TactileLabError, ValueError):
    """A scene, bench file, CSV or option cannot be used as written."""


class QuantityError(SceneError):
    """A quantity has a wrong unit, number or range."""


class LimitError(TactileLabError, ValueError):
    """A request exceeds what the coil, scope or calibration allows."""


class ParameterError(TactileLabError, ValueError):
    """A model parameter, waveform or tolerance lies outside its domain."""


class SolverError(TactileLabError, ArithmeticError):
    """The model cannot answer to the asked tolerance."""


class InstrumentError(TactileLabError, OSError):
    """An instrument failed."""


class NotFoundError(InstrumentError, FileNotFoundError):
    """Nothing answers at the address, or a vendor library is missing."""


class LinkLostError(InstrumentError, ConnectionError):
    """The instrument was unplugged or the far end closed the link."""


class NoReplyError(InstrumentError, TimeoutError):
    """The link is open but no answer came in time."""


class BadReplyError(InstrumentError, ValueError):
    """The answer is not one the dialect knows."""


class RefusedError(InstrumentError, RuntimeError):
    """The instrument reported an error of its own."""


class SamplesLostError(InstrumentError, RuntimeError):
    """Samples are missing from a stream that must be gapless."""


class SurplusError(InstrumentError, RuntimeError):
    """More samples came than time went by: when they were taken is not known."""


class InterlockError(TactileLabError, RuntimeError):
    """A safety limit tripped; it stays latched until acknowledged."""


class HaltedError(TactileLabError, RuntimeError):
    """A stop came first: a line that does not lead to output off was not sent."""


class UnsafeError(TactileLabError, RuntimeError):
    """The safe state (0 A, output off) could not be verified."""


class RecordingError(TactileLabError, OSError):
    """Samples cannot be stored as fast as they arrive, or not at all."""


class RunFolderError(TactileLabError, ValueError):
    """A folder cannot be read as a run."""


class NotIdentifiableError(TactileLabError, ValueError):
    """The data do not determine the parameter that was asked for."""
