"""Watching without force: a minute is held, and becomes a run when asked."""

import numpy as np
import pytest
from benches import WITH_GAPS

from tactile_lab.acquisition import events, runner
from tactile_lab.acquisition.events import RunState
from tactile_lab.acquisition.ring import Ring
from tactile_lab.engine.monitor import Monitor
from tactile_lab.errors import RecordingError, SceneError
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load
from tactile_lab.scope import Block, Channel, Stream
from tactile_lab.store.certificate import certify
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

FIRES = (
    "sensor.V_GS=1.65 V",
    "protocol.duration=4 s",
    "record.sample_rate=0.5 MS/s",
)
"""So far above its threshold the sensor fires without any force."""


def test_record_keeps_the_last_seconds_as_a_whole_run(tmp_path):
    seen, kept = [], []

    def emit(event):
        if isinstance(event, events.SpikesSeen):
            seen.extend(event.times)
        if isinstance(event, events.Progress) and event.elapsed > 2.5 and not kept:
            kept.append((event.elapsed, monitor.record(tmp_path, {"why": "trimmed"})))

    monitor = Monitor(load("monitor", FIRES), emit=emit, keep=1.0)
    ending = monitor.run()
    assert ending.state is RunState.COMPLETE
    assert ending.off.verified
    assert monitor.sensor.distance < 0
    assert monitor.sensor.rate > 1
    assert "below it: fires" in str(monitor.sensor)

    when, folder = kept[0]
    later = monitor.record(tmp_path)
    for path, end in ((folder, when), (later, 4.2)):
        with Run.load(path) as run:
            assert run.status == "complete"
            assert 1.0 <= run.duration < 1.3
            assert len(run.signal("V_K")) == pytest.approx(run.duration * 5e5, abs=1)
            times = run.spikes["time"]
            zero = end - run.duration
            inside = [t for t in seen if zero + 0.1 < t < end - 0.3]
            assert len(inside) <= times.size <= len(inside) + 8
            assert run.info["loss"]["spikes"] == 0
            assert run.info["loss"]["produced"] == run.info["loss"]["written"]
        assert verify(path).sound
    with Run.load(folder) as run:
        assert run.info["time_zero"] < run.info["started"], "made as it was kept"
        assert run.info["notes"]["why"] == "trimmed"
        assert run.info["coil"] == "This scene uses no coil.", "nobody looked at it"
    report = write(folder, read(folder))
    assert "fires at rest" in report.html.read_text()
    trial = read(folder).results[0]
    assert trial.response.spikes > 1 and trial.response.latency is None, "no onset"


def test_watching_stops_when_asked_and_stores_nothing_of_itself(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def emit(event):
        if isinstance(event, events.Progress) and event.elapsed > 1:
            monitor.stop("enough")

    overrides = ("protocol.duration=600 s", "record.sample_rate=10 kS/s")
    monitor = Monitor(load("monitor", overrides), emit=emit)
    ending = monitor.run()
    assert ending.state is RunState.ABORTED
    assert ending.reason == "enough"
    assert monitor.sensor.distance == pytest.approx(0.37, abs=0.02)
    assert list(tmp_path.iterdir()) == []


def test_a_scope_whose_clock_is_slow_is_watched_on(monkeypatch):
    """At 50 ppm its samples were 2 s late after 11 hours, and that ended the run."""
    monkeypatch.setattr(runner, "GRACE", 0.002)
    overrides = (
        "protocol.duration=60 s",
        "protocol.part=20 s",
        "record.sample_rate=1 kS/s",
        "simulated.clock_error=8e-5",
    )
    trials = []

    def emit(event):
        if isinstance(event, events.TrialEnded):
            trials.append(event.outcome)

    monitor = Monitor(load("monitor", overrides), emit=emit)
    ending = monitor.run()
    assert ending.state is RunState.COMPLETE, ending.reason
    spans = [one.traces["V_C1"][[0, -1], 0] for one in trials]
    assert np.ravel(spans) == pytest.approx([0.0, 20.0] * 3, abs=0.03)


def test_a_rate_that_is_not_the_circuits_is_told_as_such():
    """At 200 kS/s a sensor that fired at 6.2 Hz was told 3.1 Hz, by turns."""
    slow = "record.sample_rate=0.2 MS/s"
    overrides = (*FIRES, "protocol.duration=1 s")
    noise = "detect.threshold=4 mV", "detect.hysteresis=1 mV"
    for how, said in (
        ((slow,), "of spikes seen, not of all"),
        (noise, "too fast for the circuit: raise the threshold"),
        ((), "Hz"),
    ):
        monitor = Monitor(load("monitor", (*overrides, *how)))
        monitor.run()
        assert str(monitor.sensor).endswith(said)


def test_an_endless_monitor_goes_on_until_it_is_stopped():
    """One without end ended by itself after a day, without a word."""

    def emit(event):
        if isinstance(event, events.Progress) and event.elapsed > 5:
            monitor.stop("enough")

    overrides = ("protocol.duration=1 s", "record.sample_rate=1 kS/s")
    monitor = Monitor(load("monitor", overrides), emit=emit, endless=True)
    ending = monitor.run()
    assert ending.state is RunState.ABORTED
    assert monitor.live.reach > 4.5


def test_what_pushes_is_not_watched():
    with pytest.raises(SceneError, match="asks for a force"):
        Monitor(load("demo"))


def test_what_does_not_fit_into_the_memory_is_refused():
    with pytest.raises(SceneError, match=r"GB of memory.*sample_rate"):
        Monitor(load("monitor", ["record.sample_rate=5 MS/s"]))


def test_nothing_can_be_kept_before_the_first_sample(tmp_path):
    monitor = Monitor(load("monitor"))
    assert str(monitor.sensor) == "no V_C1 yet"
    with pytest.raises(RecordingError, match="Nothing to keep"):
        monitor.record(tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


def test_the_ring_forgets_what_is_older_than_its_length():
    ring = Ring(1.0)
    channel = Channel(signal="V_C1", input="A", range=5.0)
    stream = Stream(
        channels=(channel,), interval=0.01, full_scale=32512, shift=8, started=3.0,
        uncertainty=1e-3,
    )  # fmt: skip
    ring.segment(stream, 0.5)
    for k in range(100):
        codes = np.full((1, 7), k, np.int16)
        ring.append(Block(7 * k, codes, (False,), 0.0))
        ring.field(0.5 + 0.07 * (k + 1), float(k))
    held = ring.held()
    assert 1.0 <= held.length < 1.0 + 0.07
    assert held.start == pytest.approx(0.5 + 7.0 - held.length)
    assert held.blocks[-1].codes[0, 0] == 99
    assert len(held.field) <= 15
    ring.segment(stream, 9.0)
    with pytest.raises(RecordingError):
        ring.held()


def test_a_scope_that_polls_is_watched_and_kept_with_its_gaps(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text(WITH_GAPS)
    overrides = (
        "protocol.duration=3 s",
        'record.signals=["V_C1"]',
        "record.sample_rate=0.2 MS/s",
    )
    monitor = Monitor(load("monitor", overrides, str(bench)), keep=1.0)
    assert monitor.run().state is RunState.COMPLETE
    folder = monitor.record(tmp_path / "runs")
    with Run.load(folder) as run:
        proof = certify(run)
        assert proof.clean and proof.produced == proof.written
        assert 0.2 < proof.covered < 0.99 * proof.streamed
        assert proof.streamed == pytest.approx(run.duration, abs=0.01)
    assert verify(folder).sound


def test_noise_tells_hum_as_the_bench_puts_it_in():
    scene = load(
        "monitor",
        (
            "protocol.duration=3 s",
            "record.sample_rate=20 kS/s",
            "simulated.hum=5 mV",
        ),
    )
    monitor = Monitor(scene)
    with pytest.raises(RecordingError, match="no sample"):
        monitor.noise("V_C1")
    monitor.run()
    found = monitor.noise("V_C1")
    sizes = {line.frequency: line.rms for line in found.lines if line.mains == 50}
    assert sizes[50.0] == pytest.approx(5e-3 / np.sqrt(2), rel=0.1)
    assert found.rms >= sizes[50.0]
    with pytest.raises(RecordingError, match="V_X is not monitored"):
        monitor.noise("V_X")
