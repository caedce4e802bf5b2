"""Parts for a wanted behaviour: met, missed and refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab import Circuit, simulate
from tactile_lab.cli import cli
from tactile_lab.errors import SceneError
from tactile_lab.studies.behaviour import behaviour, push, thresholds
from tactile_lab.studies.chosen import checks_of, threshold_of
from tactile_lab.studies.parts import choose
from tactile_lab.studies.specification import E96, load_specification

ONE = {
    "title": "A light touch",
    "want": {"threshold": {"is": "60 mN"}},
    "parts": {"R1": {}, "V_GS": {}},
}


def test_thresholds_of_many_are_those_of_each() -> None:
    V_GS = np.array([1.39, 1.40, 1.45])
    found = thresholds(Circuit(), {"V_GS": V_GS})
    for bias, force in zip(V_GS, found, strict=True):
        alone = threshold_of(Circuit(V_GS=bias), 0.1)
        assert force == pytest.approx(alone, rel=4e-3)
        spikes = simulate(Circuit(V_GS=bias), push(3.0, 0.99 * alone)).spike_times
        assert len(spikes) == 0


def test_silence_is_of_the_last_spike_however_long_after() -> None:
    """A slow integrator that fires after 2 s, and once more long after."""
    parts = {"R1": 15.8e6, "R_L": 825e6, "C1": 110e-12, "C2": 820e-12, "V_GS": 1.169}
    want = {"silence": {"force": "50 mN", "is": "2 s"}}
    asked = load_specification({"want": want})
    changes = {name: np.array([value]) for name, value in parts.items()}
    later = simulate(Circuit(**parts), push(100.0, 0.05)).spike_times
    assert later[-1] > 4.4
    assert behaviour(asked, changes).silence[0] == pytest.approx(later[-1], abs=1e-6)
    (check,) = checks_of(asked.wants, Circuit(**parts))
    assert not check.met


def test_a_wanted_threshold_is_had_with_parts_that_are_sold() -> None:
    chosen = choose(load_specification(ONE))
    assert chosen.met and chosen.conflict == ()
    assert threshold_of(chosen.circuit, 0.06) == pytest.approx(0.06, rel=0.05)
    decade = chosen.values["R1"] / 10 ** np.floor(np.log10(chosen.values["R1"]))
    assert min(abs(np.array(E96) - decade)) < 1e-9
    assert chosen.values["V_GS"] == round(chosen.values["V_GS"], 3)
    assert 0.5 < chosen.good.low < chosen.good.high <= 1


def test_what_cannot_be_had_is_named_and_ends_with_1(tmp_path: Path) -> None:
    file = tmp_path / "odd.toml"
    file.write_text("""
        [want.threshold]
        is = "60 mN"
        [want.silence]
        force = "70 mN"
        is = "60 s"
        [parts.V_GS]
    """)
    said = CliRunner().invoke(cli, ["design", str(file), "--json"])
    assert said.exit_code == 1
    told = json.loads(said.stdout)
    assert not told["met"] and told["conflict"] == ["threshold", "silence"]
    assert told["yield"]["value"] == 0


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"want": {}}, "at least one of threshold"),
        ({"want": {"treshold": {"is": "1 mN"}}}, 'did you mean "threshold"'),
        ({"want": {"threshold": {"is": "20 mV"}}}, "N is needed"),
        ({"want": {"threshold": {"is": "20 mN", "within": "5"}}}, "a percentage"),
        ({"want": {"threshold": {"iss": "1 mN"}}}, 'did you mean "is"'),
        ({"want": {"threshold": {"is": "-1 mN"}}}, "is = "),
        (
            {"want": {"threshold": {"is": "20 mN", "within": "-5 %"}}},
            "more than 0 % and at most 100 %",
        ),
        ({"parts": {"R9": {}}}, "no part of the circuit"),
        ({"parts": {"L": {}}}, "resistors, capacitors and voltages"),
        ({"parts": {"R1": {"least": "2 MOhm", "most": "1 MOhm"}}}, "must be below"),
        ({"parts": {"R1": {"least": "1 MV"}}}, "Ohm is needed"),
        (
            {"parts": {"R1": {"least": "1.01 MOhm", "most": "1.015 MOhm"}}},
            "E96 has no value from",
        ),
        ({"parts": {"V_GS": {"series": "E24"}}}, "set by hand"),
        ({"parts": {"R1": {"tolerance": "-1 %"}}}, "is no tolerance"),
        ({"parts": {"R1": {"tolerance": "500 %"}}}, "is no tolerance"),
        ({"parts": {"R1": {"tolerance": "0 Ohm"}}}, "is no tolerance"),
        ({"scene": "dmeo"}, 'did you mean "demo"'),
    ],
)
def test_what_cannot_be_used_is_refused(change: dict, told: str) -> None:
    with pytest.raises(SceneError, match=told):
        load_specification({**ONE, **change})


@pytest.mark.parametrize("tolerance", ["1 %", "100 kOhm"])
def test_a_tolerance_is_a_part_of_the_value_or_a_quantity(tolerance: str) -> None:
    asked = load_specification({**ONE, "parts": {"R1": {"tolerance": tolerance}}})
    assert asked.parts[0].spread(10e6) == pytest.approx(50e3)
