"""A study that cannot be carried out is refused before a point of it is."""

import pytest
from short_studies import SHORT

from tactile_lab.errors import (
    SceneError,
)
from tactile_lab.studies.study import load_study

ZIPPED = {"key": "sensor.R1", "normal": "1 %", "zip": "a"}


VAST = {"key": "sensor.R1", "values": "1 MOhm : 2 MOhm : 1 mOhm"}


LARGE = {"key": "sensor.R1", "values": "1 MOhm : 2 MOhm : 100 Ohm"}


LARGER = {"key": "sensor.R2", "values": "1 MOhm : 2 MOhm : 100 Ohm"}


SEEDS = {"key": "simulated.seed", "values": [1, 2]}
"""Each of them was told with the numbers of one and the same seed."""


SPECIMENS = {"key": "simulated.specimen", "values": [0, 1]}
"""All had the same spikes, as if there were no spread."""


LAGS = {"key": "bench.magnet.eddy_lag", "values": ["0 s", "50 ms"]}


BOTH = {"key": "sensor.R1", "values": ["1 MOhm"], "normal": "1 %"}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"axis": [{"key": "sensor.R11", "values": [1]}]}, 'did you mean "R1"'),
        ({"axis": [{"key": "sensor.R1"}]}, "no values"),
        ({"axis": [BOTH]}, "values and normal"),
        ({"keep": ["spike_cuont"]}, 'did you mean "spike_count"'),
        ({"keep": {"a": "len("}}, "no Python expression"),
        ({"keep": {"a": "no.py:f"}}, "cannot be read"),
        ({"keep": []}, "keeps nothing"),
        ({"keep": {"a": "len(spiks)"}}, 'did you mean "spikes"'),
        ({"keep": {"a": "run.duration"}}, 'there is no run; With on = "model"'),
        (
            {"keep": ["spike_times"], "require": {"spike_times": {"most": 1}}},
            "is a row",
        ),
        ({"require": {"first_spike": {"most": "1 N"}}}, "s is needed"),
        ({"require": {"spike_count": {"least": 3, "most": 2}}}, "lies above most"),
        ({"require": {"spike_count": {}}}, "asks for nothing"),
        ({"repeat": 2}, "the model gives the same"),
        ({"runs": True}, "makes no runs"),
        ({"axis": [SEEDS], "on": "simulated"}, "for each repeat another"),
        ({"set": {"simulated.seed": 3}, "on": "simulated"}, "repeat = 12"),
        ({"axis": [SPECIMENS]}, "moves nothing of a circuit alone"),
        ({"axis": [LAGS]}, 'say on = "simulated"'),
        ({"on": "bench"}, "needs real instruments"),
        ({"require": {"spikes": {"least": 1}}}, "nothing of that name is kept"),
        ({"draw": {"points": 4}}, "draws no axis"),
        ({"axes": []}, 'did you mean "axis"'),
        ({"scene": "dmeo"}, 'did you mean "demo"'),
        ({"axis": [ZIPPED]}, "is drawn and cannot go"),
        ({"axis": [VAST]}, r"larger steps"),
        (
            {"axis": [LARGE, LARGER]},
            r"10001 × 10001 = 1e\+08 points.* GB.* h of a core",
        ),
    ],
)
def test_what_cannot_be_used_is_refused(change: dict, told: str) -> None:
    with pytest.raises(SceneError, match=told):
        load_study({**SHORT, **change})


def test_a_study_that_is_not_there_is_named_with_those_that_are() -> None:
    with pytest.raises(SceneError, match=r'did you mean "spread"\? Studies that ship'):
        load_study("spraed")


def test_what_only_the_scene_knows_may_vary_where_it_is_asked_for() -> None:
    keep = {"lag": "scene.bench.magnet.eddy_lag"}
    assert load_study({**SHORT, "axis": [LAGS], "keep": keep}).design.size == 2


def test_followers_of_a_bench_draw_a_current_of_the_circuit_alone_too() -> None:
    """0 and 1 nA give 36 and 56 spikes in `hold_10s`."""
    biases = {"key": "bench.followers.input_bias", "values": ["0 A", "1 nA"]}
    assert load_study({**SHORT, "axis": [biases]}).design.size == 2
