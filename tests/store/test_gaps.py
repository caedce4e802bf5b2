"""Records of a scope that polls, read back: each at its own time, nothing between."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_lab.store.certificate import certify
from tactile_lab.store.export import csv, mat, nwb
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.store.verify import verify

RECORDS = st.lists(
    st.tuples(st.integers(1, 3000), st.integers(0, 4000)), min_size=1, max_size=9
)
"""Samples of each record, and samples missing before it."""


def write(bench, folder, records, unseen):
    """Keep the records of samples 0, 1, ... of noise; the noise and what was kept."""
    total = sum(size + missing for size, missing in records)
    made, kept = bench.codes(total), np.zeros(total, bool)
    run = RunFolder.create(folder, "gaps", {"protocol": "hold"})
    recorder = Recorder(run, Layout(signals=bench.SIGNALS, simulated=True), reserve=0)
    recorder.segment(replace(bench.stream(), record=3000), 2.0)
    first = 0
    for size, missing in records:
        first += missing
        recorder.append(bench.block(made, first, size))
        kept[first : first + size] = True
        first += size
    if unseen:
        recorder.gap(unseen)
    recorder.close("complete", int(kept.sum()))
    return run.path, made, kept


@settings(max_examples=25)
@given(RECORDS, st.integers(0, 500), st.sampled_from([3, 40, 5000]))
def test_every_cell_holds_the_samples_of_its_own_time(bench, records, unseen, cells):
    with tempfile.TemporaryDirectory() as folder:
        path, made, kept = write(bench, Path(folder), records, unseen)
        with Run.load(path) as run:
            signal = run.signal("V_C1")
            time = 2.0 + np.flatnonzero(kept) * 1e-3
            np.testing.assert_allclose(signal.time(), time, rtol=0, atol=1e-9)
            volts = made[0, kept] / 32512 * 5.0
            np.testing.assert_allclose(signal[:], volts, atol=1e-12)

            trace = signal.trace(cells=cells)
            with pytest.MonkeyPatch.context() as long:  # one that is read in parts
                long.setattr("tactile_lab.store.signal.AT_ONCE", 2)
                parts = run.signal("V_C1").trace(cells=cells)
            for name in ("time", "low", "mean", "high", "gap"):
                assert np.array_equal(getattr(parts, name), getattr(trace, name)), name
            edges = np.searchsorted(time, trace.time - 1e-9)
            assert edges[0] == 0 and (np.diff(edges) > 0).all()
            np.testing.assert_allclose(trace.low, np.minimum.reduceat(volts, edges))
            np.testing.assert_allclose(trace.high, np.maximum.reduceat(volts, edges))
            # no cell reaches over a gap longer than itself
            for start, stop in zip(edges, [*edges[1:], time.size], strict=True):
                longest = np.diff(time[start:stop]).max(initial=0.0)
                assert longest <= max(trace.width, 1e-3) + 1.1e-3

            seen, missing = int(kept.sum()), int((~kept).sum()) + unseen
            proof = certify(run)
            assert proof.clean
            assert proof.covered == pytest.approx(seen * 1e-3)
            assert proof.streamed == pytest.approx((seen + missing) * 1e-3)
            gaps = run.gaps
            assert int(gaps["missing"].sum()) == missing
            assert gaps["end"] - gaps["start"] == pytest.approx(gaps["missing"] * 1e-3)
        assert verify(path).sound


def test_exports_keep_the_gaps(bench, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    path, _, kept = write(bench, tmp_path, [(700, 30), (600, 100), (900, 4)], 50)
    time = 2.0 + np.flatnonzero(kept) * 1e-3
    with Run.load(path) as run:
        ends = run.gaps["end"]
        mat.export(run, tmp_path / "run.mat", Selection())
        nwb.export(run, tmp_path / "run.nwb", Selection())
        csv.export(run, tmp_path / "csv", Selection(start=2.5, end=3.0))
        frame = run.to_xarray()
    np.testing.assert_allclose(frame["time"], time, atol=1e-9)

    table = np.loadtxt(tmp_path / "csv" / "signals.csv", delimiter=",", skiprows=1)
    inside = time[(time > 2.4999) & (time < 2.9999)]
    np.testing.assert_allclose(table[:, 0], inside, atol=1e-9)
    gaps = np.loadtxt(tmp_path / "csv" / "gaps.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(gaps, [2.73, 2.83])

    read = scipy.io.loadmat(tmp_path / "run.mat", simplify_cells=True)
    np.testing.assert_allclose(read["time"], time, atol=1e-9)
    np.testing.assert_allclose(read["gaps"]["end"], ends)

    with pynwb.NWBHDF5IO(str(tmp_path / "run.nwb"), "r") as file:
        session = file.read()
        assert set(session.acquisition) >= {"V_C1", "V_K"}
        series = session.acquisition["V_K"]
        np.testing.assert_allclose(series.timestamps[:], time, atol=1e-9)
        assert series.data.shape == time.shape
        invalid = session.invalid_times.to_dataframe()
        np.testing.assert_allclose(invalid["stop_time"], ends)
