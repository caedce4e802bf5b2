"""What `import tactile_lab` gives a script."""

import doctest
import pydoc
import shutil
import subprocess
import sys

import numpy as np
import pytest

import tactile_lab
from tactile_lab.errors import InstrumentError, RunFolderError, SceneError
from tactile_lab.store import run as stored
from tactile_lab.store.uncounted import uncounted

SHORT = {
    "protocol.levels": [0.18],
    "protocol.rest": 0.5,
    "record.signals": ["V_C1", "V_K", "spikes"],
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    with tactile_lab.run("demo", SHORT, out=tmp_path_factory.mktemp("runs")) as made:
        yield made


def test_the_example_of_the_help_is_true(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = doctest.testmod(tactile_lab, optionflags=doctest.ELLIPSIS)
    assert found.attempted > 10
    assert found.failed == 0


def test_the_help_is_a_page_with_every_name():
    page = pydoc.render_doc(tactile_lab, renderer=pydoc.plaintext)
    for name in tactile_lab.__all__:
        assert name in page
        assert name in dir(tactile_lab)


def test_importing_it_loads_nothing_heavy():
    code = (
        "import sys, tactile_lab; tactile_lab.TactileLabError; "
        "print(*(n.split('.')[0] for n in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not set(done.stdout.split()) & {"numpy", "pydantic", "h5py", "scipy"}


def test_plan_is_the_verb_also_after_its_room_was_imported():
    import tactile_lab.planning.plan

    assert tactile_lab.plan is tactile_lab.scripting.plan


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = tactile_lab.nonsense


def test_si_numbers_and_texts_are_the_same_change():
    numbers = tactile_lab.load("hold_10s", {"protocol.level": 0.12, "sensor.m": 5})
    texts = tactile_lab.load("hold_10s", ['protocol.level="120 mN"', "sensor.m=5"])
    assert numbers.to_dict() == texts.to_dict()
    array = {"protocol.levels": np.array([0.08, 0.12])}
    assert tactile_lab.load("demo", array).protocol.levels == (0.08, 0.12)


def test_a_loaded_scene_can_be_changed_further():
    once = tactile_lab.load("hold_10s", {"protocol.level": 0.12})
    twice = tactile_lab.load(once, {"protocol.hold": "3 s"})
    assert (twice.protocol.level, twice.protocol.hold) == (0.12, 3.0)
    assert twice.name == "hold_10s"
    assert tactile_lab.load(once) is once


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"protocol.hodl": 2}, 'protocol.hodl = 2: .*did you mean "hold"'),
        ({"protocol.hold": float("nan")}, "finite"),
        ({"protocol.hold": -1}, "above 0 s"),
        ({"protocol.hold": "2 V"}, "s is needed"),
        ({"hold": 2}, "table.key=value"),
    ],
)
def test_a_wrong_change_is_named(changes, told):
    with pytest.raises(SceneError, match=told):
        tactile_lab.load("demo", changes)


def test_a_file_in_a_change_is_looked_for_where_one_is(tmp_path, monkeypatch):
    (tmp_path / "mine.csv").write_text("time_s,force_N\n0,0\n1,0.1\n2,0\n")
    monkeypatch.chdir(tmp_path)
    for changes in ({"protocol.file": "mine.csv"}, ["protocol.file=mine.csv"]):
        scene = tactile_lab.load("waveform", changes)
        assert scene.protocol.file == str(tmp_path / "mine.csv")


def test_a_run_says_what_it_is(run):
    assert repr(run).startswith("<Run of demo: complete, simulated, 3.306 s, 1 trial, ")
    shown = run._repr_html_()
    assert "180 mN" in shown and "complete" in shown and "loss: 0 of" in shown


def test_a_closed_run_can_still_be_shown(run):
    again = tactile_lab.Run.load(run.path)
    again.close()
    assert "closed" in repr(again)


def test_the_force_of_a_run_is_what_was_asked_for(run):
    held = run.trials[0]["start"] + 1.5
    assert run.force.at(held) == pytest.approx(0.18, rel=0.01)
    assert run.force.at(run.duration) == pytest.approx(0.0, abs=1e-3)


def test_a_run_tells_its_adaptation_by_the_circuit_s_own_law(run):
    found = run.adaptation()
    assert found.tau.low < 8.69 < found.tau.high
    assert found.V_GS.value == pytest.approx(1.4, abs=5e-3)
    with pytest.raises(IndexError):
        run.adaptation(7)


def test_which_spikes_are_counted_is_asked_once_for_all_trials(run, monkeypatch):
    """It was asked of all trials for each of them, and reads where a channel left."""
    asked = []

    def counting(of):
        asked.append(of)
        return uncounted(of)

    monkeypatch.setattr(stored, "uncounted", counting)
    with tactile_lab.Run.load(run.path) as again:
        assert again.adaptation().tau.value == again.adaptation(-1).tau.value
        assert asked == [again]


def test_signals_in_columns_stored_and_derived(run):
    pytest.importorskip("xarray")
    data = run.to_xarray(1.0, 3.0, signals=("V_C1", "force", "I_DS", "rate"), rate=1e3)
    assert data["time"].size == 2000
    assert [data[name].attrs["units"] for name in data] == ["V", "N", "A", "Hz"]
    node = run.signal("V_C1")
    first = node[node.between(1.0, 1.001)]
    assert float(data["V_C1"][0]) == pytest.approx(first.mean())
    spikes = run.spikes["time"]
    last = spikes[spikes < 2.9][-2:]
    shown = float(data["rate"].sel(time=2.9, method="nearest"))
    assert shown == pytest.approx(1 / np.diff(last)[0])
    # Eq. (16) at rest: what the divider leaves over is what T2 draws
    c, V_C1 = run.scene.circuit, float(data["V_C1"][-200:].mean())
    static = (c.V_S - V_C1) / c.R1 - V_C1 / c.R2
    assert float(data["I_DS"][-200:].mean()) == pytest.approx(static, rel=0.2)


def test_pandas_tables(run):
    pytest.importorskip("pandas")
    frame = run.to_pandas(start=1.0, end=1.5, rate=1e3)
    assert list(frame) == ["V_C1", "V_K", "force"]
    assert frame.index.name == "time" and len(frame) == 500
    alone = run.to_pandas(start=1.0, end=1.5, rate=1e3, signals="V_C1")
    assert list(alone) == ["V_C1"] and alone["V_C1"].equals(frame["V_C1"])
    trials = run.to_pandas("trials")
    assert trials["label"].tolist() == ["180 mN"]
    assert len(run.to_pandas("spikes")) == run.trials[0]["spikes"]
    rate = run.to_pandas("rate")
    assert len(rate) == run.trials[0]["spikes"], "one for each interval, and silence"
    assert rate["rate"].iloc[-1] == 0.0
    with pytest.raises(RunFolderError, match="no table"):
        run.to_pandas("nonsense")
    with pytest.raises(RunFolderError, match="V_C9"):
        run.to_pandas(signals=["V_C9"])


def test_a_missing_library_is_named(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(RunFolderError, match="pip install pandas"):
        run.to_pandas()


def test_the_latest_run_is_found_and_runs_are_listed(run, tmp_path):
    out = run.path.parent
    assert tactile_lab.latest(out).path == run.path
    assert [entry.load().path for entry in tactile_lab.runs(out)] == [run.path]
    with pytest.raises(RunFolderError, match="no run with protocol = hold"):
        tactile_lab.latest(out, where="protocol = hold")
    with pytest.raises(RunFolderError, match="no run that can be read"):
        tactile_lab.latest(tmp_path)


def test_plan_and_report_show_themselves(run):
    plan = tactile_lab.plan("demo", SHORT)
    assert repr(plan) == "<Plan of demo: 3.305 s, 1 trial, 0 warnings>"
    assert "coil source" in plan._repr_html_() and "REAL" not in plan._repr_html_()
    report = tactile_lab.write_report(run)
    assert report.html.parent == run.path
    assert repr(report) == f"<Report of {run.path.name}: {report.html}>"
    assert report._repr_html_().startswith("<iframe srcdoc=")


def test_several_runs_are_reported_side_by_side(run, tmp_path):
    other = shutil.copytree(run.path, tmp_path / "other")
    found = tactile_lab.write_report([run, other], tmp_path / "page")
    assert [one.entry.name for one in found.runs] == [run.path.name, "other"]
    (page,) = (tmp_path / "page").glob("*.html")
    assert "2 runs side by side" in page.read_text(encoding="utf-8")


def test_simulate_takes_a_circuit_or_a_scene():
    force = tactile_lab.Waveform.pulse(0.15, ramp=0.01, hold=2.0)
    alone = tactile_lab.simulate(tactile_lab.Circuit(V_GS=1.41), force)
    assert alone.spike_times.size > 3
    scene = tactile_lab.simulate("demo", {"protocol.levels": [0.2]}, keep=["V_C1"])
    assert scene.spike_times is None and "spikes" in scene.left_out
    with pytest.raises(ValueError, match="Waveform"):
        tactile_lab.simulate(tactile_lab.Circuit(), ())
    with pytest.raises(ValueError, match="of its own"):
        tactile_lab.simulate("demo", force)


def test_a_faulted_run_is_an_error_that_names_its_folder(tmp_path):
    changes = {**SHORT, "simulated.coil_unplugged": 1.0}
    with pytest.raises((InstrumentError, tactile_lab.TactileLabError)) as why:
        tactile_lab.run("demo", changes, out=tmp_path)
    (folder,) = tmp_path.iterdir()
    told = " ".join([str(why.value), *getattr(why.value, "__notes__", ())])
    assert str(folder) in told
