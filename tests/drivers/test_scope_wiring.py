"""Wiring that a scope cannot have is refused, with what there is."""

from __future__ import annotations

import pytest

from drivers.picoscope.scope import PicoScope
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import LimitError
from tactile_lab.instruments.channels import check_channels, described
from tactile_lab.scope import Channel

# known before the scope is opened, so a bench can be refused before that
CAPABILITY = PicoScope(clock=SimulatedClock()).capability


def channel(**change: object) -> Channel:
    return Channel(**{"signal": "V_K", "input": "A", "range": 5.0, **change})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("channels", "text"),
    [
        ([], "No scope input is enabled"),
        ([channel(input="E")], "V_K is wired to scope input E, but the scope has A, B"),
        ([channel(), channel(signal="V_C1")], "V_K and V_C1 are both wired to .* A"),
        ([channel(range=3.0)], r"range 3 V, none of the scope's: 0\.02, 0\.05"),
        ([channel(coupling="GND")], "Coupling 'GND' of V_K is none of AC, DC"),
    ],
)
def test_refused(channels: list[Channel], text: str) -> None:
    with pytest.raises(LimitError, match=text):
        check_channels(channels, CAPABILITY)


def test_all_ranges_and_inputs_are_taken() -> None:
    for volts in CAPABILITY.ranges:
        check_channels([channel(input=i, range=volts) for i in "ABCD"], CAPABILITY)


def test_in_words() -> None:
    assert described([channel(offset=-2.5)]) == {
        "input_A": "V_K: ±5 V, offset -2.5 V, DC"
    }
