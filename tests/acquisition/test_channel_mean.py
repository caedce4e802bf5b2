"""The analogue output of a teslameter on a scope channel, from bench file to record."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_backend.bench import open_bench
from tactile_lab.acquisition.channel_mean import ChannelMean
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.scene.load import load
from tactile_lab.scope import Block, Channel, Stream
from tactile_lab.signals import FIELD_AVERAGING
from tactile_lab.store.run import Run

BENCH = """
name = "analogue teslameter"
simulated = true
[coil]
baud = 19200
[[scope.channels]]
signal = "coil_current"
input = "A"
range = "500 mV"
shunt = "0.1 Ohm"
[[scope.channels]]
signal = "field"
input = "B"
range = "{range}"
tesla_per_volt = "0.05 T/V"
zero = "30 mV"
[magnet]
r = "6 mm"
"""
SHORT = ("protocol.points=5", "protocol.loops=0", "record.sample_rate=2 kS/s")
FIELD = Channel(signal="field", input="B", range=0.5, scale=0.05, zero=0.03)


def scene(folder, range="500 mV", overrides=SHORT, more=""):
    path = folder / "bench.toml"
    path.write_text(BENCH.format(range=range) + more)
    return load("calibrate_field", overrides, str(path))


def test_a_calibration_reads_the_field_from_the_scope(tmp_path):
    loaded = scene(tmp_path)
    done = Execution(loaded, tmp_path / "runs").run()
    assert done.state is RunState.COMPLETE, done.reason
    with Run.load(done.folder) as run:
        assert "field" not in run.signals
        field = run.field
        assert (np.diff(field["time"]) >= FIELD_AVERAGING * 0.999).all()
        trials = run.trials[run.trials["pause"] == 0]
        for trial in trials:
            inside = (field["time"] > trial["hold_start"] + trial["start"]) & (
                field["time"] < trial["hold_end"] + trial["start"]
            )
            ampere = float(trial["label"].split()[1].replace(b"\xe2\x88\x92", b"-"))
            assert field["field"][inside].mean() == pytest.approx(
                11e-6 * ampere, abs=0.7e-3
            )  # the loop is 0.55 mT to either side


def test_the_meter_s_range_is_watched(tmp_path):
    loaded = scene(tmp_path, range="200 mV")
    assert "expected to reach" in " ".join(plan(loaded, preview=False).warnings)
    bench = open_bench(loaded, needs(loaded))
    done = Execution(loaded, tmp_path / "runs", bench=bench).run()
    assert done.exit_code == 3
    assert "scope input B" in done.reason


def test_a_coarse_range_is_warned_of(tmp_path):
    told = plan(scene(tmp_path, range="2 V"), preview=False).warnings
    assert any("one code of the field channel" in text for text in told)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('tesla_per_volt = "0.05 T/V"', "", "display"),
        ('tesla_per_volt = "0.05 T/V"', 'tesla_per_volt = "0 T/V"', "display"),
        ('zero = "30 mV"', 'coupling = "AC"', "DC"),
        ('shunt = "0.1 Ohm"', 'tesla_per_volt = "1 T/V"', "belongs to"),
        ('zero = "30 mV"', "scale = 2.0", "not both"),
        ("[magnet]", "[field_meter]\n[magnet]", "measured twice"),
    ],
)
def test_what_a_bench_file_may_not_say(tmp_path, old, new, why):
    path = tmp_path / "bench.toml"
    path.write_text(BENCH.format(range="500 mV").replace(old, new))
    with pytest.raises(SceneError, match=why):
        load("calibrate_field", (), str(path))


def blocks(codes, cuts):
    edges = [0, *sorted(cuts), codes.size]
    for a, b in itertools.pairwise(edges):
        rows = np.vstack([np.zeros(b - a, np.int16), codes[a:b]])
        yield Block(a, np.ascontiguousarray(rows), (False, False), 0.0)


@given(cuts=st.lists(st.integers(0, 1000), max_size=9))
def test_blocks_of_any_size_give_the_same_means(cuts):
    other = Channel(signal="coil_current", input="A", range=1.0)
    stream = Stream(
        channels=(other, FIELD), interval=1e-3, full_scale=32512, shift=8,
        started=0.0, uncertainty=0.0,
    )  # fmt: skip
    codes = (np.arange(1000) % 120 * 256).astype(np.int16)
    mean = ChannelMean(stream, 5.0, "field")
    found = [r for block in blocks(codes, cuts) for r in mean.feed(block)]
    volts = codes.reshape(5, 200).mean(axis=1) / 32512 * 0.5
    assert [r.value for r in found] == pytest.approx((volts - 0.03) * 0.05)
    assert [r.time for r in found] == pytest.approx(
        [5.0995 + 0.2 * k for k in range(5)]
    )


def test_a_clipped_input_is_no_reading():
    stream = Stream(
        channels=(FIELD,), interval=1e-3, full_scale=32512, shift=8,
        started=0.0, uncertainty=0.0,
    )  # fmt: skip
    full = Block(0, np.full((1, 200), 32000, np.int16), (False,), 0.0)
    with pytest.raises(LimitError, match=r"input B, .26.5 mT to 23.5 mT"):
        ChannelMean(stream, 0.0, "field").feed(full)
