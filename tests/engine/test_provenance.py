"""A run's folder says where it came from, and needs nothing outside itself."""

import json
import shutil
from datetime import datetime, timedelta

import pytest

from tactile_lab.acquisition import events
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.provenance import temperature
from tactile_lab.planning.needs import needs
from tactile_lab.report.from_run import read
from tactile_lab.scene.load import load
from tactile_lab.store.compare import differences
from tactile_lab.store.folder import digest, read_info
from tactile_lab.store.verify import verify

PROTOCOL = """
from typing import ClassVar
from tactile_lab.trial import Protocol, Trial
from tactile_lab.waveform import Waveform


class Tap(Protocol):
    name: ClassVar[str] = "tap"
    title: ClassVar[str] = "Tap"
    signals: ClassVar[tuple[str, ...]] = ("V_C1", "spikes")

    def trials(self):
        yield Trial(force=Waveform.pulse(0.2, ramp=0.1, hold=0.3), label="tap")
"""
BENCH = """
name = "own bench"
simulated = true
[coil]
dialect = "rows/mine.toml"
[scope]
[[scope.channels]]
signal = "V_C1"
input = "A"
range = "2 V"
offset = "-2.5 V"
[[scope.channels]]
signal = "V_K"
input = "C"
[magnet]
r = "6 mm"
calibration = "cal/mine.csv"
"""
FIELD = "current_A,field_T\n-2,-0.022\n0,0\n2,0.022\n"


@pytest.fixture
def own(tmp_path):
    """A folder with everything of a user's own; its scene."""
    from importlib import resources

    folder = tmp_path / "mine"
    for name in ("rows", "cal"):
        (folder / name).mkdir(parents=True)
    row = (
        resources.files("tactile_lab.instruments")
        .joinpath("rows/coil/kepco-bop.toml")
        .read_text()
    )
    (folder / "rows" / "mine.toml").write_text(row)
    (folder / "cal" / "mine.csv").write_text(FIELD)
    (folder / "scene.toml").write_text(BENCH)  # a name the run uses itself
    (folder / "tap.py").write_text(PROTOCOL)
    scene = folder / "s.toml"
    scene.write_text(
        '[protocol]\nname = "tap"\nsource = "tap.py"\n[bench]\nfile = "scene.toml"\n'
        '[conditions]\ntemperature = "23.5 °C"\noperator = "Ada"\nsensor = "S12"\n',
        encoding="utf-8",
    )
    return scene


def test_a_run_is_read_and_repeated_without_what_it_was_made_from(
    run_scene, own, tmp_path
):
    ran = run_scene(scene=str(own))
    assert ran.done.state is RunState.COMPLETE, ran.done.reason
    files = read_info(ran.folder)["files"]
    assert set(files) == {
        "scene.toml", "inputs/scene.toml", "inputs/tap.py", "inputs/mine.csv",
        "inputs/mine.toml",
    }  # fmt: skip
    assert files["inputs/mine.csv"] == digest(FIELD.encode())
    assert (ran.folder / "inputs" / "tap.py").read_text() == PROTOCOL
    assert str(tmp_path) not in (ran.folder / "scene.toml").read_text()

    moved = tmp_path / "elsewhere" / "run"
    shutil.copytree(ran.folder, moved)
    shutil.rmtree(own.parent)
    shutil.rmtree(ran.folder)
    found = read(moved)
    assert found.bench == "own bench"
    assert found.conditions["temperature"] == "23.5 °C (entered)"
    again = run_scene(scene=str(moved / "scene.toml"))
    assert verify(again.folder).sound
    difference = differences(moved, again.folder)
    assert difference.results == ()
    assert difference.calibration == ()
    # who was there and how warm it was is not repeated
    assert any("temperature" in line for line in difference.environment)
    assert read_info(again.folder)["notes"] == {}


def test_a_changed_copy_is_found(run_scene, own):
    folder = run_scene(scene=str(own)).folder
    (folder / "inputs" / "mine.csv").write_text(FIELD.replace("0.022", "0.023"))
    (finding,) = verify(folder).findings
    assert finding.where == "inputs/mine.csv"


def test_the_source_of_a_protocol_that_ships_is_kept_and_compared(run_scene, short):
    one, other = run_scene(*short), run_scene(*short)
    source = (one.folder / "inputs" / "pulses.py").read_text()
    assert "class Pulses" in source
    assert differences(one.folder, other.folder).environment == ()
    info = read_info(other.folder)
    changed = info["files"] | {"inputs/pulses.py": digest(b"else")}
    (other.folder / "run.json").write_text(json.dumps(info | {"files": changed}))
    found = differences(one.folder, other.folder).environment
    assert "inputs/pulses.py is not the same" in found


def test_settings_are_read_before_and_after_and_a_turned_knob_is_told(run_scene, short):
    from sim_backend.bench import open_bench

    turned = {}

    def bench(scene):
        made = open_bench(scene, needs(scene))
        read_back = made.coil.settings
        made.coil.settings = lambda: {**read_back(), **turned}
        return made

    def turn(execution, event):
        if isinstance(event, events.Progress) and event.elapsed > 0.4:
            turned["compliance_V"] = "9"

    ran = run_scene(*short, bench=bench, watch=turn)
    info = read_info(ran.folder)
    assert info["instruments"]["coil"]["compliance_V"] == "14"
    assert info["instruments"]["coil"]["output"] == "on"
    assert info["instruments_after"]["coil"]["output"] == "off"
    assert float(info["instruments"]["scope"]["interval_s"]) == 1e-6
    line = "coil: compliance_V was 14 at the start, 9 at the end"
    assert info["instruments_changed"] == [line]
    assert line in read(ran.folder).warnings
    assert any(isinstance(e, events.Message) and e.text == line for e in ran.told)


@pytest.mark.parametrize(
    ("text", "kelvin"), [("23.5 °C", 296.65), ("20 degC", 293.15), ("300 K", 300.0)]
)
def test_temperature_is_entered_in_either_unit(text, kelvin):
    scene = load("demo", [f"conditions.temperature={text}"])
    found = temperature(scene, {"field meter": {"temperature": "22.5"}})
    assert found == {"K": pytest.approx(kelvin), "from": "entered"}


def test_temperature_is_read_where_nobody_enters_it():
    read_back = {"coil": {}, "field meter": {"temperature": "22.5"}}
    found = temperature(load("demo"), read_back)
    assert found == {"K": pytest.approx(295.65), "from": "field meter"}
    assert temperature(load("demo"), {}) == {"K": None, "from": None}


def test_a_run_tells_from_its_first_sample_on_when_that_was_and_with_what(
    run_scene, short
):
    """Only when the folder was made was kept, 1.5 s before on a bench with links.

    A run that was killed listed no instruments at all.
    """
    seen = {}

    def watch(execution, event):
        now = datetime.now().astimezone()
        if isinstance(event, events.RecordBegun):
            seen["ago"] = execution.bench.clock.now() - event.origin
            seen["info"], seen["after"] = read_info(execution.folder.path), now
        else:
            seen.setdefault("before", now)

    ran = run_scene(*short, watch=watch)
    info, ended = seen["info"], read_info(ran.folder)
    begun = datetime.fromisoformat(info["time_zero"]) + timedelta(seconds=seen["ago"])
    cut = timedelta(milliseconds=1)  # what is left of a time as text
    assert seen["before"] - cut < begun <= seen["after"]
    assert info["time_zero"] == ended["time_zero"]
    assert info["temperature"] == ended["temperature"]
    known, whole = info["instruments"], ended["instruments"]
    assert {name: it["identity"] for name, it in known.items()} == {
        name: it["identity"] for name, it in whole.items()
    }
