"""Whole runs on the simulated bench: real drivers, simulated far ends, real files."""

from importlib import resources

import numpy as np
import pytest

from tactile_lab.acquisition import events
from tactile_lab.acquisition.events import RunState
from tactile_lab.planning.needs import needs
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.table import trials_table
from tactile_lab.store.certificate import certify


def codes(ran):
    with ran.stored() as run:
        return {name: run.signal(name).codes[:] for name in run.signals}


def test_the_demo_finds_the_papers_spikes_and_loses_nothing(run_scene):
    ran = run_scene()
    assert ran.done.state is RunState.COMPLETE
    assert ran.done.exit_code == 0
    assert ran.done.off.verified
    counts = [
        e.outcome.spike_times.size for e in ran.told if isinstance(e, events.TrialEnded)
    ]
    # ideal force gives 0, 4, 17, 26; the follower's bias lowers the threshold a little
    for found, ideal in zip(counts, (0, 4, 17, 26), strict=True):
        assert abs(found - ideal) <= 1
    assert dict(ran.done.loss) == {"samples": 0, "spikes": 0}
    with ran.stored() as run:
        assert run.signals == ("V_C1", "V_C2", "V_K", "coil_current")
        assert run.info["status"] == "complete"
        planned = run.info["planned_s"]
        assert run.trials["end"][-1] == pytest.approx(planned, abs=0.02)
        assert len(run.signal("V_K")) >= 18e6
        assert len(run.signal("V_K")) == pytest.approx(1e6 * run.duration, rel=1e-3)
        assert run.spikes.size == sum(counts) == ran.done.spikes
        assert np.abs(run.current["setpoint"]).max() == pytest.approx(1.0, rel=0.02)
        assert np.all(run.current["asked"] < run.current["time"])
        assert run.applied.doubt == pytest.approx(0.0, abs=1e-9)
        assert run.current["measured"][-1] == pytest.approx(0.0, abs=5e-3)


def test_the_same_seed_gives_the_same_samples_and_another_does_not(run_scene, short):
    first, again, other = (
        codes(run_scene(*short, f"simulated.seed={seed}")) for seed in (5, 5, 6)
    )
    for name, values in first.items():
        np.testing.assert_array_equal(values, again[name])
    assert any(not np.array_equal(v, other[k]) for k, v in first.items())


def test_noise_above_the_threshold_adds_spikes(run_scene, short):
    quiet = run_scene(*short)
    noisy = run_scene(*short, 'simulated.noise={ V_K = "200 mV" }')
    assert noisy.done.spikes > quiet.done.spikes + 10


def test_a_threshold_from_the_noise_is_found_told_and_kept(run_scene, short):
    given = run_scene(*short)
    ran = run_scene(*short, "detect.threshold=auto")
    assert ran.done.spikes == given.done.spikes
    assert dict(ran.done.loss) == {"samples": 0, "spikes": 0}
    told = [e.text for e in ran.told if isinstance(e, events.Message)]
    assert any("estimated from the noise" in text for text in told)
    with ran.stored() as run:
        found = run.info["detection"]
        # 20 mV of noise and 39 mV of code step are 23 mV: 7 of them
        assert found["from"] == "noise"
        assert 0.10 < found["threshold_V"] < 0.25
        attrs = run.table("spikes").attrs
        volts = attrs["threshold"] * attrs["gain"] + attrs["offset"]
        assert volts == pytest.approx(found["threshold_V"])
        assert run.records("gaps").size == 0
        assert run.axis.first[0] == 0  # what was learnt from is stored, too


def test_more_noise_means_a_higher_threshold(run_scene, short):
    ran = run_scene(
        *short, "detect.threshold=auto", 'simulated.noise={ V_K = "200 mV" }'
    )
    quiet = run_scene(*short)
    # the sample after a spike's peak may lie at 1.7 V: one in a hundred stays below
    assert abs(ran.done.spikes - quiet.done.spikes) <= 1
    assert 1.2 < ran.stored().info["detection"]["threshold_V"] < 1.7


def test_each_spike_is_told_with_the_rate_it_brings(run_scene, short):
    ran = run_scene(*short)
    seen = [e for e in ran.told if isinstance(e, events.SpikesSeen)]
    times = np.concatenate([e.times for e in seen])
    rates = np.concatenate([e.rates for e in seen])
    assert rates[0] == 0 and seen[0].intervals[0] == np.inf
    np.testing.assert_allclose(rates[1:], 1 / np.diff(times))


def test_a_spike_that_is_over_after_its_trial_counts_in_it(run_scene):
    """It was found when that trial was counted, and so in none."""
    pressed = ", ".join(['"20 mN"'] * 50)
    ran = run_scene(
        f"protocol.levels=[{pressed}]",
        *("protocol.ramp=0 s", "protocol.hold=0.05 s", "protocol.rest=0.05 s"),
        *("sensor.V_GS=1.58 V", 'record.signals=["V_C2", "spikes"]'),
        "record.sample_rate=1 kS/s",
        'bench.scope.channels=[{signal="V_C2", input="B", range="2 V", '
        'offset="-1.7 V"}]',
    )
    told = [e.outcome for e in ran.told if isinstance(e, events.TrialEnded)]
    with ran.stored() as run:
        times, trials = run.spikes["time"], run.trials
        inside = [
            np.count_nonzero((times >= one["start"]) & (times < one["end"]))
            for one in trials
        ]
        assert sum(inside) > 40
        assert trials["spikes"].tolist() == inside
    assert [outcome.spike_times.size for outcome in told] == inside


def test_no_drain_current_is_derived_from_a_limit(run_scene, short):
    """V_C1 rested at 3.9 V, its channel's end: 76 nA of I_DS were told, 24 flowed."""
    ran = run_scene(
        *short,
        'record.signals=["V_C1"]',
        'bench.scope.channels=[{signal="V_C1", input="A", range="2 V", '
        'offset="-1.9 V"}, {signal="coil_current", input="D", range="200 mV", '
        'shunt="0.1 Ohm"}]',
    )
    with ran.stored() as run:
        found, cut_off = run.I_DS, run.overrange("V_C1")
        limit = np.zeros(found.time.size, bool)
        for start, end in cut_off:
            limit |= (found.time > start) & (found.time < end)
        assert np.all(np.isnan(found.current[limit])) and limit.sum() > 100
        clear = np.ones(found.time.size, bool)
        for start, end in cut_off:
            clear &= (found.time < start - 0.1) | (found.time > end + 0.1)
        assert np.all(found.current[clear] > 40e-9) and clear.sum() > 100


def test_too_slow_sampling_loses_spikes(run_scene, short):
    fast = run_scene(*short)
    slow = run_scene(*short, "record.sample_rate=0.2 MS/s")
    assert 0 < slow.done.spikes < fast.done.spikes


def test_V_K_is_acquired_for_spikes_even_where_it_is_not_stored(run_scene, short):
    ran = run_scene(*short, 'record.signals=["spikes"]')
    assert ran.done.spikes > 5
    assert dict(ran.done.loss) == {"samples": 0, "spikes": None}
    with ran.stored() as run:
        assert run.signals == ()
        assert run.spikes.size == ran.done.spikes
        assert str(certify(run)).startswith("loss: no samples were asked for")


def test_V_C1_alone_searches_no_spikes_and_opens_one_channel(run_scene, short):
    ran = run_scene(*short, 'record.signals=["V_C1"]')
    assert ran.done.spikes is None
    with ran.stored() as run:
        assert run.signals == ("V_C1",)
        assert run.detection is None


def test_the_field_is_read_while_the_coil_plays(run_scene, short):
    ran = run_scene(*short, 'record.signals=["field"]')
    assert ran.done.state is RunState.COMPLETE, ran.done.reason
    with ran.stored() as run:
        assert run.signals == ()
        assert run.field["field"].size > 5
        assert run.field["field"].max() == pytest.approx(0.011, rel=0.05)
        assert (np.diff(run.field["time"]) > 0).all()


def test_V_C2s_resets_stand_in_for_an_unwired_V_K(run_scene, short, tmp_path):
    wired = run_scene(*short)
    bench = tmp_path / "bench.toml"
    bench.write_text(
        """
name = "no V_K"
simulated = true
[coil]
dialect = "kepco-bop"
port = "sim://coil"
baud = 19200
[scope]
driver = "ps3000a"
[[scope.channels]]
signal = "V_C2"
input = "B"
range = "2 V"
offset = "-1.7 V"
[magnet]
r = "6 mm"
"""
    )
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f"""
[bench]
file = "{bench}"
[protocol]
name = "pulses"
levels = ["200 mN"]
hold = "0.8 s"
rest = "0.3 s"
[record]
signals = ["spikes"]
"""
    )
    ran = run_scene(scene=str(scene))
    assert ran.done.spikes == wired.done.spikes


def test_stopping_keeps_the_data_and_leaves_the_coil_off(run_scene, short):
    def stop_at_half(execution, event):
        if isinstance(event, events.Progress) and event.elapsed > 0.7:
            execution.stop("a person pressed STOP")

    ran = run_scene(*short, watch=stop_at_half)
    assert ran.done.state is RunState.ABORTED
    assert ran.done.off.verified
    assert ran.done.reason == "a person pressed STOP"
    with ran.stored() as run:
        assert run.info["status"] == "aborted"
        assert 0.5e6 < len(run.signal("V_K")) < 1.6e6
    assert dict(ran.done.loss) == {"samples": 0, "spikes": 0}


def test_a_trial_that_was_cut_short_is_reported_with_all_its_spikes(run_scene, short):
    def stop_late(execution, event):
        if isinstance(event, events.Progress) and event.elapsed > 1.0:
            execution.stop("a person pressed STOP")

    ran = run_scene(*short, watch=stop_late)
    findings = find(read(ran.folder))
    (trial,) = findings.run.results
    assert ran.done.spikes >= trial.response.spikes > 3
    assert not trial.complete
    assert (trial.label, trial.level) == ("200 mN", 0.2)
    with ran.stored() as run:
        assert trial.start + trial.duration == run.stopped
        # the fall of the force is recorded, and is no part of the hold
        assert run.axis.time_of(float(run.samples)) > run.stopped + 0.1
        assert run.current["setpoint"][-1] == 0.0
        current = run.signal("coil_current")
        # in steps at the slew limit, and the shunt saw each
        fall = run.current[run.current["time"] > run.stopped]
        steps = fall[np.append(np.diff(fall["setpoint"]) < 0, False)]
        assert len(steps) >= 2
        for time, setpoint, *_ in steps:
            seen = current[round(1e6 * (time + 0.02)) :][:1000]
            assert np.mean(seen) == pytest.approx(setpoint, abs=0.01)
        before = current[: round(1e6 * run.stopped)]
        assert abs(np.mean(current[-100:])) < 0.02 * abs(np.mean(before[-100:]))
    assert trial.hold[1] == pytest.approx(trial.duration)
    assert trials_table(findings.run).rows[0][0] == "200 mN, cut short"
    assert findings.missing[0] == "No trial was completed: nothing is concluded."
    assert findings.missing[1].startswith("Cut short: 200 mN.")
    drawn = next(p for p in findings.plots if p.name == "figure")
    ticks = [s for p in drawn.panels for s in p.series if s.mark == "ticks"]
    assert sum(np.size(s.x) for s in ticks) == trial.response.spikes
    assert findings.beside.twin.spikes.missed == 0, "those are no trial's either"
    fell = ran.done.spikes - trial.response.spikes
    told = [text for text in findings.run.warnings if "as the force fell" in text]
    assert bool(told) == bool(fell) and all(str(fell) in text for text in told)


def test_a_run_that_clipped_says_so_in_its_report(run_scene, tmp_path):
    own = resources.files("tactile_lab.scene") / "simulated_bench.toml"
    bench = tmp_path / "fixed.toml"
    bench.write_text(own.read_text().replace("auto_range = true", ""))
    overrides = (
        f"bench.file={bench}", 'protocol.levels=["-200 mN"]', "protocol.hold=0.5 s",
        "protocol.rest=0.3 s",
    )  # fmt: skip
    run = read(run_scene(*overrides, scene="bipolar").folder)
    (text,) = [text for text in run.warnings if "left the range" in text]
    assert text.startswith("V_C1 left the range of scope input A, 500 mV to 4.5 V")
    ((start, end),) = run.trace("V_C1").overrange
    assert 0.3 < start < 0.6 < end < 1.4


def test_spikes_made_by_the_mains_are_warned_of_in_the_report(run_scene, short):
    hum = "mains, 50 Hz"
    quiet, loud = (
        read(run_scene(*short, f"simulated.hum={volts} V").folder)
        for volts in (0.0, 0.6)
    )
    assert not any(hum in text for text in quiet.warnings)
    assert any(hum in text for text in loud.warnings)
    assert loud.spike_times.size > quiet.spike_times.size + 20


def test_a_rest_that_was_cut_off_at_the_range_is_no_number(run_scene, short):
    from sim_backend.bench import open_bench
    from sim_backend.picoscope.faults import ScopeFault

    beyond = ScopeFault(kind="overrange", sample=1, duration=0.5, inputs=("A",))
    ran = run_scene(
        *short,
        'protocol.levels=["20 mN", "20 mN", "20 mN"]',
        bench=lambda scene: open_bench(scene, needs(scene), scope_faults=[beyond]),
    )
    run = read(ran.folder)
    ((_, end),) = run.trace("V_C1").overrange
    first, *later = run.trials
    assert first.start < end < later[0].start - 0.2
    assert (first.rest, first.drift) == (None, None)
    assert [t.rest for t in later] == [pytest.approx(4.35, abs=0.05)] * 2
    assert later[0].drift == 0.0  # the first that is known is compared with
    ended = [e.outcome for e in ran.told if isinstance(e, events.TrialEnded)]
    assert ["V_C1" in one.cut_off for one in ended] == [True, False, False]


def test_recovery_is_neither_streamed_nor_stored_nor_a_gap(run_scene, tmp_path):
    file = tmp_path / "with_pause.py"
    file.write_text(
        "from typing import ClassVar\n"
        "from tactile_lab.trial import Protocol, Trial\n"
        "from tactile_lab.waveform import Waveform\n"
        "class WithPause(Protocol):\n"
        "    name: ClassVar[str] = 'with_pause'\n"
        "    title: ClassVar[str] = 'With a pause'\n"
        "    signals: ClassVar[tuple[str, ...]] = ('V_C1', 'V_K', 'spikes')\n"
        "    def trials(self):\n"
        "        pulse = Waveform.pulse(0.2, ramp=0.1, hold=0.5)\n"
        "        yield Trial(force=pulse, label='one', level=0.2)\n"
        "        yield Trial(force=Waveform.constant(0.0), label='recovery',\n"
        "                    duration=50.0, pause=True)\n"
        "        yield Trial(force=pulse, label='two', level=0.2)\n"
    )
    ran = run_scene(scene=str(file))
    assert ran.done.state is RunState.COMPLETE, ran.done.reason
    ended = [e.outcome for e in ran.told if isinstance(e, events.TrialEnded)]
    assert [o.trial.label for o in ended] == ["one", "recovery", "two"]
    assert ended[2].spike_times.size > 0
    assert dict(ran.done.loss) == {"samples": 0, "spikes": 0}
    with ran.stored() as run:
        assert len(run.axis.first) == 2
        assert len(run.signal("V_K")) < 3e6
        assert run.duration > 51
        planned = run.info["planned_s"]
        assert run.trials["end"][-1] == pytest.approx(planned, abs=0.02)
        assert run.records("gaps").size == 0
        pause = run.records("pauses")[0]
        assert pause["end"] - pause["start"] == pytest.approx(50.0, abs=0.2)
        # spikes of the second trial lie where its samples say
        late = run.spikes["time"][run.spikes["time"] > 50]
        np.testing.assert_allclose(
            late, ended[2].start + ended[2].spike_times, atol=1e-6
        )


def test_settings_are_told_in_units_that_suit_them(run_scene, short):
    run = read(run_scene(*short).folder)
    assert run.sensor["R1"] == "9.58 MOhm"
    assert run.sensor["C1"] == "680 pF"
    assert run.sensor["tau"] == "8.69 s"
    assert run.parameters["levels"] == "200 mN"


def test_steps_that_no_shunt_shows_are_dated_by_the_answer_of_the_source(run_scene):
    """By when it had come they were 7 ms late, and a force told by spikes too small."""
    changes = 'protocol.levels=["120 mN"]', "protocol.hold=0.2 s", "protocol.rest=0.1 s"
    found = []
    for recorded in ('["V_K"]', '["V_K", "coil_current"]'):
        ran = run_scene(*changes, f"record.signals={recorded}")
        with ran.stored() as run:
            found.append(run.applied.steps)
    by_answer, by_shunt = found
    assert by_answer.shape == by_shunt.shape
    assert np.abs(by_answer - by_shunt)[1:, 0].max() < 1e-3


def test_the_simulated_source_is_waited_for_as_long_as_the_bench_file_says(run_scene):
    """At 1200 baud its name takes 0.33 s; 0.2 s were waited, whatever timeout said."""
    slow = "bench.coil.baud=1200", "record.sample_rate=50 kS/s", "protocol.hold=0.6 s"
    levels = 'protocol.levels=["100 mN"]'
    assert run_scene(*slow, levels).done.state is RunState.FAULTED
    patient = run_scene(*slow, levels, "bench.coil.timeout=0.7 s")
    assert patient.done.state is RunState.COMPLETE, patient.done.reason
