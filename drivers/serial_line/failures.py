"""What goes wrong on a serial wire, told: which instrument, where, what, what to do.

`pyserial` has a text of its own for each call of each system; which one failed says
less than that the port is gone.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Sequence

_GONE = (errno.EIO, errno.ENODEV, errno.ENXIO, errno.EBADF)
"""What a system says of a port whose adapter was pulled."""

_PORT_GONE = re.compile(r"readiness to read|ClearCommError|ReadFile|WriteFile")
"""What `pyserial` says of one."""

_RESET = (errno.ECONNRESET, errno.EPIPE, errno.ECONNABORTED)
"""What a system says of a connection that the far end has ended."""

_CLOSED = re.compile(r"socket disconnected|connection failed")
"""What `pyserial` says of one."""


def no_answer(what: str, port: str, asked: str, got: bytes, timeout: float) -> str:
    """No whole answer to a line came within `timeout` s."""
    return (
        f"The {what} at {port} answered {f'only {got!r}' if got else 'nothing'} to "
        f"{asked!r} within {timeout:g} s. Check power, cable, "
        + (
            "terminator, and that no other program is connected there."
            if _is_network(port)
            else "baud rate and terminator."
        )
    )


def silence(what: str, port: str, asked: str, name: str, patience: float) -> str:
    """Nothing came, to `asked` nor to the question for its `name`, for `patience` s."""
    after = f"in the {patience:g} s after it" if patience else "after it"
    return (
        f"The {what} at {port} answered nothing to {asked!r}, nor to {name!r} {after}: "
        "it is switched off, hangs, or its line is cut. Look at its front panel, check "
        "power and cable."
    )


def unanswered(
    what: str, port: str, asked: str, timeout: float, reported: Sequence[str]
) -> str:
    """It says its name, and twice gave no answer to one question."""
    if reported:
        return (
            f"The {what} at {port} did not answer {asked!r} and reports "
            f"{', '.join(reported)}. Look at its front panel: somebody may have "
            "switched something there."
        )
    return (
        f"The {what} at {port} answered nothing to {asked!r} within {timeout:g} s, "
        "twice, though it says its name: it takes longer for that, or does not know "
        "it. Give it more time by timeout in its table of the bench file, or compare "
        "the line with its manual."
    )


def no_text(what: str, port: str, asked: str, got: bytes) -> str:
    """An answer holds what no dialect says."""
    return (
        f"The {what} at {port} answered {got!r} to {asked!r}, which is no text of its "
        "dialect. Check "
        + (
            "its terminator, and that the port is that of its text commands."
            if _is_network(port)
            else "baud rate, parity and cable."
        )
    )


def lost(what: str, port: str, reason: Exception) -> str:
    """The port failed while it was open, as `pyserial` or the system said."""
    text, number = str(reason), system_number(reason)
    if number in _RESET or _CLOSED.search(text):
        why = "the far end has closed the connection"
        then = (
            "Check that it is switched on and that no other program is connected there"
        )
    elif number in _GONE or _PORT_GONE.search(text):
        why = "its port is gone, as when a plug is pulled"
        then = "Plug it in again, check the adapter's cable and power"
    else:
        why = os.strerror(number) if number else text
        then = "Check cable and power"
    return f"The link to the {what} at {port} was lost: {why}. {then}."


def refused(what: str, port: str, line: str, answer: str) -> str:
    """It reported an error of its own to a line."""
    return (
        f"The {what} at {port} refused {line!r}: {answer}. Look at its front panel; "
        "its manual says what that error means."
    )


def gathered(trouble: Sequence[str]) -> str:
    """What went wrong in several steps, `step: why` each: steps of one cause once."""
    steps: dict[str, dict[str, None]] = {}
    for one in trouble:
        step, _, why = one.partition(": ")
        steps.setdefault(why, {})[step] = None
    return " | ".join(f"{', '.join(which)}: {why}" for why, which in steps.items())


def system_number(reason: Exception) -> int | None:
    """The system's number of an error that `pyserial` or `termios` raised."""
    number = getattr(reason, "errno", None)
    if number is None and (stated := re.search(r"\[Errno (\d+)\]", str(reason))):
        number = int(stated[1])
    if number is None and reason.args and isinstance(reason.args[0], int):
        number = reason.args[0]  # what `termios` raises has no `errno`
    return number


def _is_network(port: str) -> bool:
    return port.startswith("socket:")
