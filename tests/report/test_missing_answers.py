"""What a run cannot answer is said, and the rest is kept."""

import json
from dataclasses import replace

import numpy as np
import pytest

from protocols.hold import Hold
from tactile_lab.commands.show import describe, rows
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import CUT_OFF, TOO_FAST, MeasuredTrial
from tactile_lab.model.circuit import Circuit
from tactile_lab.plugins import protocol_class
from tactile_lab.quantity import show
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.overview import overview
from tactile_lab.report.page import page
from tactile_lab.report.results import results
from tactile_lab.report.table import trials_table
from tactile_lab.report.write import write
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run
from tactile_lab.store.uncounted import faster_than


def test_a_trial_whose_spikes_could_not_be_told_has_a_count_and_no_rate():
    train = MeasuredTrial(
        label="120 mN", level=0.12, start=0.0, duration=2.0, hold=(0.25, 1.5),
        spike_times=np.array([0.3, 0.4, 0.5]),
    )  # fmt: skip
    assert train.response.latency == 0.3
    blind = replace(train, uncounted=CUT_OFF)
    assert blind.response.spikes == 3
    assert (blind.response.latency, blind.response.peak_rate) == (None, None)
    assert "left its range" in blind.why_not


def test_no_rate_is_told_of_spikes_that_fall_between_two_samples(tmp_path):
    """At 200 kS/s V_K misses 44 % of them: a rate of 3.1 Hz was told of one of 6.2."""
    asked = {
        "protocol.levels": (0.2,),
        "protocol.hold": 1.5,
        "protocol.rest": 0.3,
        "record.sample_rate": 2e5,
    }
    folder = Execution(load("demo", asked), tmp_path).run().folder
    found = find(read(folder))
    (trial,) = results(found)["trials"]
    assert trial["spikes"] > 3, "what was seen is told"
    for key in ("latency_s", "peak_rate_Hz", "final_rate_Hz", "fall", "adaptation"):
        assert trial[key] is None, key
    assert "between two samples" in trial["uncounted"]
    told = trials_table(found.run)
    assert f"{trial['spikes']}†" in told.rows[0]
    assert "†: seen, no count" in told.note
    assert f"{trial['spikes']}†" in page(found, ())
    assert "between two samples" in " ".join(found.missing)
    assert "completed" not in " ".join(found.missing)
    assert not found.conclusion.sentences
    assert "Rate" not in {panel.label for panel in overview(found.run).panels}
    lines = [str(value) for _, value in rows(describe(folder))]
    assert any(line.endswith("spikes seen, no count") for line in lines)
    with Run.load(folder) as run, pytest.raises(NotIdentifiableError, match="between"):
        run.adaptation()


def test_nothing_is_told_of_spikes_that_come_faster_than_the_circuit_can_fire(tmp_path):
    """The answer to a cause was sought over 9,494 of them, for minutes."""
    asked = {
        "protocol.levels": (0.2,),
        "protocol.hold": 1.0,
        "protocol.rest": 0.2,
        "simulated.noise.V_K": 0.15,
        "simulated.deviation.V_GS": 4e-3,
    }
    folder = Execution(load("demo", asked), tmp_path).run().folder
    found = find(read(folder))
    (trial,) = results(found)["trials"]
    assert trial["spikes"] > 500, "what was seen is told"
    fits = "adaptation", "circuit_adaptation"
    for key in ("latency_s", "peak_rate_Hz", "final_rate_Hz", "fall", *fits):
        assert trial[key] is None, key
    assert trial["uncounted"] == TOO_FAST
    assert f"No latency, rate or fit of 200 mN: {TOO_FAST}." in found.missing
    assert not found.conclusion.sentences
    assert found.run.train is None, "no cause is sought in them"
    assert found.beside is not None and found.beside.explanation is not None
    assert found.beside.explanation.cause is None
    with Run.load(folder) as run, pytest.raises(NotIdentifiableError, match="faster"):
        run.adaptation()


def test_a_false_spike_among_right_ones_takes_no_number_with_it():
    circuit, right = load("demo").circuit, np.arange(0.3, 3.0, 0.1)
    assert not faster_than(circuit, right)
    for extra, told in ((right[:2], False), (right[:1], False), (right, True)):
        seen = np.sort(np.concatenate([right, extra + 1e-3]))
        assert faster_than(circuit, seen) is told
    assert not faster_than(circuit, np.array([0.3, 0.301])), "two tell too little"


def test_what_no_spikes_are_needed_for_is_told_though_some_are_missed(tmp_path):
    asked = {"protocol.duration": 2.0, "protocol.part": 2.0, "record.sample_rate": 2e5}
    folder = Execution(load("monitor", asked), tmp_path).run().folder
    (said,) = find(read(folder)).conclusion.sentences
    assert said.startswith("V_C1 ended")


def test_a_run_without_current_has_no_twin(rate_force):
    assert find(replace(rate_force, belief=None)).beside is None


def test_too_few_spikes_to_fit_are_said(rate_force, tmp_path):
    held = replace(rate_force, protocol=Hold(), trials=rate_force.trials[2:3])
    report = write(tmp_path, held)
    film, said = report.findings.missing
    assert said.startswith("No time constant of an exponential: not identifiable: ")
    found = json.loads(report.results.read_text(encoding="utf-8"))
    assert found["missing"] == [film, said]
    assert found["conclusion"]["time_constant_s"] is None
    assert found["trials"][0]["spikes"] > 3, "what there is, is kept"
    assert "Not determined" in report.html.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("protocol", "says"),
    [
        ("hold", "spikes were not looked for"),
        ("rate_force", "spikes were not looked for"),
        ("repeat", "spikes were not looked for"),
        ("threshold_search", "spikes were not looked for"),
        ("bipolar", "No drain current"),
        ("sine_sweep", "No gain"),
    ],
)
def test_a_run_without_its_signal_says_so_and_claims_nothing(
    rate_force, protocol, says
):
    blind = replace(
        rate_force, protocol=protocol_class(protocol)(), searched=False, traces=()
    )
    found = find(blind)
    assert says in found.missing[0]
    assert not found.conclusion.sentences


def test_what_cannot_be_computed_is_said_and_the_rest_is_kept(rate_force, tmp_path):
    first, second = rate_force.traces
    ragged = replace(
        first,
        time=np.sort(np.random.default_rng(0).uniform(0, 8, first.time.size)),
    )
    broken = replace(
        rate_force, traces=(ragged, second), circuit=replace(Circuit(), V_S=1e-3)
    )
    report = write(tmp_path, broken)
    assert any("No I_DS" in text for text in report.findings.missing)
    assert "Not determined" in report.html.read_text(encoding="utf-8")
    assert sum(t.response.spikes for t in report.findings.run.results) > 30
    assert report.html.exists()


def test_a_trial_under_a_force_that_never_came_is_said_to_be(tmp_path):
    """A press of 20 ms stood as 150 mN without a spike; 12.6 mN had come."""
    asked = {
        "protocol.levels": (0.15,),
        "protocol.ramp": 0.005,
        "protocol.hold": 0.02,
        "protocol.rest": 0.2,
        "record.signals": ("force", "V_K", "spikes"),
    }
    found = find(read(Execution(load("demo", asked), tmp_path).run().folder))
    (said,) = (text for text in found.missing if "did not get there" in text)
    applied = show(float(found.run.force.value.max()), "N", 3)
    assert f"150 mN to {applied} at the nearest" in said
    slow = asked | {"protocol.ramp": 0.25, "protocol.hold": 0.2}
    there = find(read(Execution(load("demo", slow), tmp_path).run().folder))
    assert not any("did not get there" in text for text in there.missing)
