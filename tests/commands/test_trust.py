"""A run that was sent here executes none of its code before somebody trusts it."""

import json
import shutil

import pytest

from tactile_lab.engine.execution import Execution
from tactile_lab.errors import SceneError
from tactile_lab.scene.load import load
from tactile_lab.trust import known_file

OWN = """
from pathlib import Path
from typing import ClassVar

from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

with (Path(__file__).parent.parent / "executed").open("a") as executed:
    executed.write("once ")


class Own(Protocol):
    name: ClassVar[str] = "own"
    title: ClassVar[str] = "My own"
    signals: ClassVar[tuple[str, ...]] = ("V_C1",)

    def trials(self) -> Trials:
        force = Waveform.pulse(0.05, ramp=0.1, hold=0.2, rest=0.1)
        yield Trial(force=force, label="50 mN")
"""


@pytest.fixture(scope="module")
def theirs(tmp_path_factory):
    """The folder of a run that somebody else recorded."""
    folder = tmp_path_factory.mktemp("theirs")
    (folder / "own.py").write_text(OWN)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(folder))
        scene = load(folder / "own.py", ("record.sample_rate=10 kS/s",))
        made = Execution(scene, folder / "runs").run().folder
        load(made / "scene.toml")  # here it is known
    (made / "executed").unlink()
    return made


@pytest.fixture
def sent(theirs, tmp_path, monkeypatch):
    """The same, on another computer."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "mine"))
    return shutil.copytree(theirs, tmp_path / "sent")


READING = (
    ("report",),
    ("identify", "V_GS"),
    ("run", "--again"),
    ("plan",),
    ("show",),
    ("verify",),
    ("recover",),
    ("export", "--to", "csv"),
)


def asked(verb, run):
    name, *rest = verb
    if name == "plan":
        return (name, run / "scene.toml")
    return (name, *rest, run) if rest == ["--again"] else (name, run, *rest)


@pytest.mark.parametrize("verb", READING, ids=lambda verb: verb[0])
def test_no_verb_executes_the_code_of_a_run_that_was_sent(tactile_lab, sent, verb):
    answer = tactile_lab(*asked(verb, sent))
    assert not (sent / "executed").exists(), "the code was executed"
    if verb[0] in ("report", "identify", "run", "plan"):
        assert answer.code == 2
        assert f"tactile-lab trust {sent}" in answer.err
        assert "own.py" in answer.err


def test_code_that_is_trusted_is_executed(tactile_lab, sent):
    told = tactile_lab("trust", sent)
    assert told.code == 0
    assert "as it was recorded" in told.out
    assert str(sent / "inputs" / "own.py") in known_file().read_text()
    assert tactile_lab("report", sent).code == 0
    assert (sent / "executed").exists()


def test_code_that_was_changed_is_not_known_any_more(tactile_lab, sent):
    tactile_lab("trust", sent)
    with (sent / "inputs" / "own.py").open("a") as own:
        own.write("print('and this')\n")
    assert tactile_lab("report", sent).code == 2
    assert "NOT AS IT WAS RECORDED" in tactile_lab("trust", sent).out


def test_a_driver_named_by_the_bench_of_a_run_is_code_too(tactile_lab, tmp_path):
    run = tmp_path / "sent"
    run.mkdir()
    (run / "run.json").write_text(json.dumps({"schema": 1, "status": "complete"}))
    (run / "scene.toml").write_text(
        '[protocol]\nname = "pulses"\n[bench]\nfile = "bench.toml"\n'
    )
    (run / "bench.toml").write_text('[coil]\ndriver = "../coil.py"\n')
    (tmp_path / "coil.py").write_text("open('executed', 'w')\n")
    answer = tactile_lab("plan", run / "scene.toml")
    assert answer.code == 2
    assert str(tmp_path / "coil.py") in answer.err


@pytest.mark.parametrize("name", ["libps3000a.so", "libps3000a.so.2"])
def test_the_library_of_a_scope_is_code_that_runs_here_make_known(
    tmp_path, monkeypatch, name
):
    (tmp_path / name).write_bytes(b"of a vendor")
    bench = tmp_path / "bench.toml"
    bench.write_text(
        'simulated = true\n[scope]\ndriver = "ps3000a"\n'
        f'library = "{name}"\n'
        '[[scope.channels]]\nsignal = "V_C1"\ninput = "A"\nrange = "2 V"\n'
        '[coil]\n[magnet]\nr = "6 mm"\n'
    )
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    asked = (
        "record.sample_rate=10 kS/s",
        "protocol.duration=100 ms",
        'record.signals=["V_C1"]',
    )
    scene = load("monitor", asked, bench=bench)
    assert scene.bench.scope.library == str(tmp_path / name)
    run = Execution(scene, tmp_path / "runs").run().folder
    assert load(run / "scene.toml").bench.scope == scene.bench.scope
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "another computer's"))
    with pytest.raises(SceneError, match=name):
        load(run / "scene.toml")
