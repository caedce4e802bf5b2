"""Spikes that no circuit gives, as noise at a threshold does: they come too fast.

A few of them are let pass, as one that noise adds now and then among right ones.
"""

from __future__ import annotations

FEWEST, SHARE = 3, 0.1
"""So many intervals that no circuit can give, and such a part of them all."""


def are_false(short: int, spikes: int) -> bool:
    """Whether spikes are no circuit's.

    Args:
        short: how many of their intervals are shorter than it can give.
        spikes: how many there are.
    """
    return short >= max(FEWEST, SHARE * (spikes - 1))
