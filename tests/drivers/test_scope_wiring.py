"""Wiring that a scope cannot have is refused, with what there is."""

from __future__ import annotations

import pytest

from tactile_lab.errors import LimitError
from tactile_lab.instruments.channels import check_channels, described
from tactile_lab.instruments.registry import scope_capability
from tactile_lab.planning.plan import plan
from tactile_lab.scene.load import load
from tactile_lab.scope import Channel

SCENE = "demo"
# known before the scope is opened, so a bench can be refused before that
CAPABILITY = scope_capability(load(SCENE).bench.scope)


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
        (
            [channel(range=0.2, offset=-2.5)],
            "−2.5 V of V_K is beyond ±250 mV.* 200 mV.* a range of 500 mV or more",
        ),
        ([channel(range=20.0, offset=21.0)], "21 V of V_K is beyond ±20 V.* offset.$"),
    ],
)
def test_refused(channels: list[Channel], text: str) -> None:
    with pytest.raises(LimitError, match=text):
        check_channels(channels, CAPABILITY)


def test_all_ranges_and_inputs_are_taken() -> None:
    for volts in CAPABILITY.ranges:
        check_channels([channel(input=i, range=volts) for i in "ABCD"], CAPABILITY)


def test_an_offset_beyond_its_range_is_refused_by_the_plan() -> None:
    """The plan took it, and the run failed once the scope was open."""
    wired = '{signal="V_C1",input="A",range="0.2 V",offset="-2.5 V"}'
    changes = [f"bench.scope.channels=[{wired}]", 'record.signals=["V_C1"]']
    with pytest.raises(LimitError, match="beyond ±250 mV"):
        plan(load(SCENE, changes), preview=False)


def test_in_words() -> None:
    assert described([channel(offset=-2.5)]) == {
        "input_A": "V_K: ±5 V, offset -2.5 V, DC"
    }
