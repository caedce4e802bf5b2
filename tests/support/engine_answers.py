"""What an engine answers when it is asked."""

import os
import time
from collections.abc import Callable
from typing import TypeVar

from tactile_lab.engine.engine import Engine, Reply
from tactile_lab.engine.link import Link

T = TypeVar("T")


def pid_of(engine: Engine) -> int:
    """The process it works in."""
    return os.getpid()


def size_of(engine: Engine, asked: bytes) -> int:
    """Of what came along with the question."""
    return len(asked)


def answered(link: Link, act: Callable[[Engine], T]) -> Reply[T]:
    """The reply of the engine to a question, waited for."""
    told: list[Reply[T]] = []
    link.ask(told.append, act)
    while not told:
        link.poll()
        time.sleep(0.001)
    return told[0]
