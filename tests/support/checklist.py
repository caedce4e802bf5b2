"""What the checklists of a lab's own instruments share: see tests/hardware."""

import os
from collections.abc import Callable

import pytest
from patient import D, patient

PORT = os.environ.get("TACTILE_LAB_PORT", "/dev/ttyUSB0")


def needs(which: str, what: str) -> list[pytest.MarkDecorator]:
    """Marks of a checklist that runs only where its instrument is asked for."""
    return [
        pytest.mark.hardware,
        pytest.mark.timeout(0),
        pytest.mark.skipif(
            os.environ.get("TACTILE_LAB_HARDWARE") != which,
            reason=f"needs {what}; set TACTILE_LAB_HARDWARE={which}",
        ),
    ]


def by_hand(what: str) -> pytest.MarkDecorator:
    """Mark of a step at which someone must do something beside the computer."""
    return pytest.mark.skipif(
        os.environ.get("TACTILE_LAB_OPERATOR") != "1",
        reason=f"someone must {what}; set TACTILE_LAB_OPERATOR=1",
    )


def row_of(dialect: Callable[[str], D], usual: str, **wire: object) -> D:
    """The serial row that TACTILE_LAB_DIALECT names, or the usual one.

    `dialect` reads it. Its timeout is long: how busy this computer is, is not asked.
    """
    row = dialect(os.environ.get("TACTILE_LAB_DIALECT", usual))
    return patient(row, timeout=2.0, **wire)


def fact(name: str, value: object) -> None:
    """Print a line to be copied into the checklist."""
    print(f"\nFACT {name}: {value}")
