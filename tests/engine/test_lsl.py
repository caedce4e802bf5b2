"""Spikes, envelopes and events of a run, heard by LSL's own library."""

import json
import sys

import numpy as np
import pylsl
import pytest

from tactile_lab.acquisition.events import Message
from tactile_lab.engine.commands import begin_run
from tactile_lab.engine.execution import Execution
from tactile_lab.engine.link import Link
from tactile_lab.engine.lsl import ENVELOPES, LslStreams, kept_open
from tactile_lab.engine.request import Request
from tactile_lab.errors import SceneError
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run

FEW = (
    'protocol.levels=["200 mN"]',
    "protocol.hold=0.5 s",
    "protocol.rest=0.1 s",
)
"""One pulse with some spikes."""

LONG = 60.0
"""Longest wait for what must come, s."""


@pytest.fixture
def streams():
    """Streams, and what they warn of."""
    warned = []
    made = LslStreams(warned.append)
    made.warned = warned
    yield made
    made.close()


def inlet(streams, name):
    (found,) = pylsl.resolve_byprop("source_id", f"{streams.source}-{name}", 1, LONG)
    opened = pylsl.StreamInlet(found, recover=False)
    opened.open_stream(LONG)
    return opened


def lines_until(events, last):
    """Lines of the stream of events, up to one of the kind `last`."""
    lines = []
    while not lines or lines[-1]["event"] != last:
        sample, _ = events.pull_sample(LONG)
        assert sample is not None, f"no {last} came: {lines[-3:]}"
        lines.append(json.loads(sample[0]))
    return lines


def run(streams, folder, *overrides, scene="demo", **named):
    execution = Execution(load(scene, overrides), folder, others=(streams,), **named)
    streams.begin(execution)
    done = execution.run()
    streams.end({"status": str(done.state)})
    return done


def test_every_spike_and_millisecond_of_a_run_comes_with_its_time(streams, tmp_path):
    heard = {name: inlet(streams, name) for name in ("spikes", "envelopes", "events")}
    done = run(streams, tmp_path, *FEW)
    lines = lines_until(heard["events"], "result")
    zero = next(one["run_zero_lsl_s"] for one in lines if one["event"] == "clock")
    spikes, stamps = heard["spikes"].pull_chunk(
        LONG, done.spikes, min_samples=done.spikes
    )
    number, times, amplitudes = np.array(spikes).T
    assert number.tolist() == list(range(1, done.spikes + 1))
    np.testing.assert_array_equal(np.array(stamps), zero + times)
    with Run.load(done.folder) as stored:
        kept = stored.spikes
        np.testing.assert_allclose(amplitudes, kept["amplitude"], rtol=1e-12)
        # stored times are aligned with the coil after the run
        np.testing.assert_allclose(times, kept["time"], atol=1e-3)
        length = stored.samples / load("demo").record.sample_rate
    rows, at = heard["envelopes"].pull_chunk(LONG, 1 << 20, min_samples=1000)
    rows = np.array(rows)
    assert len(rows) == pytest.approx(length * 1000, abs=2)
    np.testing.assert_allclose(np.diff(at), 1e-3, atol=1e-6)
    labels = [label for label, _ in ENVELOPES]
    low, mean, high = (
        rows[:, labels.index(f"V_K {k}")] for k in ("min", "mean", "max")
    )
    assert (low <= mean).all() and (mean <= high).all()
    assert high.max() == pytest.approx(amplitudes.max(), rel=1e-3)
    assert streams.warned == []


def test_time_stamps_are_the_computers_clock_where_time_is_real(streams, tmp_path):
    spikes, events = inlet(streams, "spikes"), inlet(streams, "events")
    before = pylsl.local_clock()
    done = run(
        streams,
        tmp_path,
        'protocol.levels=["200 mN"]',
        "protocol.hold=0.8 s",
        "protocol.rest=0.2 s",
        realtime=True,
    )
    after = pylsl.local_clock()
    lines = lines_until(events, "result")
    clocks = [line for line in lines if line["event"] == "clock"]
    assert 0 < clocks[0]["uncertainty_s"] < 0.1
    assert all(line["least_behind_s"] > 0 for line in clocks)
    found, stamps = spikes.pull_chunk(LONG, done.spikes, min_samples=done.spikes)
    assert len(found) == done.spikes > 0
    assert before < stamps[0] <= stamps[-1] < after


def test_a_run_of_the_window_is_published_where_that_is_asked(tmp_path):
    kept_open.cache_clear()
    with Link(separate=False, realtime=False) as link:
        told = list(
            link.follow(begin_run, Request("demo", FEW), tmp_path, {}, publish=True)
        )
        streams = kept_open()
        assert any(streams.source in one.text for one in told if type(one) is Message)
        events = inlet(streams, "events")
        for _ in link.follow(
            begin_run, Request("demo", FEW), tmp_path, {}, publish=True
        ):
            pass
        lines_until(events, "begun")  # after what the run before still had to tell
        lines_until(events, "clock")
    streams.close()
    kept_open.cache_clear()


def test_streams_that_fail_are_told_of_once_and_the_run_goes_on(streams, tmp_path):
    def broken(*arguments):
        raise RuntimeError("the library is gone")

    streams._spikes.push_sample = broken
    done = run(streams, tmp_path, *FEW)
    streams.close()
    assert done.state == "complete"
    assert done.loss["samples"] == 0
    (told,) = streams.warned
    assert "the library is gone" in told
    with Run.load(done.folder) as stored:
        assert stored.spikes.size == done.spikes > 0


def test_without_the_library_it_is_refused_before_anything_is_opened(monkeypatch):
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(SceneError, match="pip install pylsl"):
        LslStreams(print)
