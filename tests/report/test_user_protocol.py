"""A protocol file of the user's own concludes and draws, or says where it fails."""

import html
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import ParameterError, SceneError
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load
from tactile_lab.trust import remember

OWN = """
from typing import ClassVar

from tactile_lab.conclusion import Conclusion, Table
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform


class Own(Protocol):
    name: ClassVar[str] = "own"
    title: ClassVar[str] = "My own"
    signals: ClassVar[tuple[str, ...]] = ("force", "V_C1")

    def trials(self) -> Trials:
        pulse = Waveform.pulse(0.05, ramp=0.1, hold=0.3, rest=0.2)
        yield Trial(force=pulse, label="50 mN", level=0.05, hold=(0.1, 0.4))

    def conclude(self, run):
        (trial,) = run.results
        fall = trial.rest - run.mean("V_C1", *trial.held)
        rows = (("1", f"{fall:.3f}"),)
        table = Table(title="Falls", headings=("Trial", "V"), rows=rows)
        said = (f"V_C1 falls by {fall:.3f} V.",)
        return Conclusion(said, {"fall_V": fall}, tables=(table,))

    def plots(self, run):
        trace = run.trace("V_C1")
        series = Series(x=trace.time, y=trace.mean, colour="V_C1")
        yield Plot(name="summary", caption="V_C1 alone.", x_label="Time", x_unit="s",
                   panels=(Panel(label="V_C1", unit="V", series=(series,)),))
"""
SLOW = ("record.sample_rate=10 kS/s",)
WAITS = """
from typing import ClassVar

from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform


class Waits(ForceProtocol):
    name: ClassVar[str] = "waits"
    title: ClassVar[str] = "Each begins at another time"
    signals: ClassVar[tuple[str, ...]] = ("force", "V_C1")

    def presentations(self) -> Trials:
        for before, rest in ((0.5, 0.2), (0.0, 0.0), (0.3, 0.0)):
            push = Waveform.pulse(0.05, ramp=0.1, hold=0.3, rest=rest).shifted(before)
            points = zip(push.time, push.value)
            force = push if before == 0 else Waveform.through([(0.0, 0.0), *points])
            yield Trial(force=force, label=f"after {before:g} s")
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The run of such a file, which is gone since."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "own.py").write_text(OWN)
    done = Execution(load(str(folder / "own.py"), SLOW), folder / "runs").run()
    assert done.exit_code == 0, done.reason
    (folder / "own.py").unlink()
    return done.folder


def kept(made, folder, old="", new=""):
    """The run again, its kept protocol with `old` replaced."""
    shutil.copytree(made, folder / "run")
    file = folder / "run" / "inputs" / "own.py"
    assert old in file.read_text()
    text = file.read_text().replace(old, new)
    file.unlink()
    file.write_text(text)
    remember([file])
    return folder / "run"


def line_of(text, folder):
    lines = (folder / "inputs" / "own.py").read_text().splitlines()
    return 1 + next(i for i, line in enumerate(lines) if text in line)


def test_an_old_run_concludes_and_draws_by_the_file_it_keeps(made):
    report = write(made, read(made))
    found = json.loads(report.results.read_text())
    fall = found["conclusion"]["fall_V"]
    assert 0.05 < fall < 0.5
    assert found["statements"] == [f"V_C1 falls by {fall:.3f} V."]
    assert found["tables"][0]["rows"] == [["1", f"{fall:.3f}"]]
    page = report.html.read_text(encoding="utf-8")
    assert "V_C1 alone." in page and "<h2>Falls</h2>" in page
    assert (made / "summary.png").exists() and report.png.exists()
    said = CliRunner().invoke(cli, ["report", str(made)]).stdout
    assert f"\n\n{found['statements'][0]}\n\nFalls\n" in said
    assert "\n\nfigure  " in said


def test_each_trial_begins_where_its_own_force_does(tmp_path):
    """All counted from where the first one's begins, where the second stands still.

    The second does not rest, so that its fall ends in the third, before that begins.
    """
    (tmp_path / "waits.py").write_text(WAITS)
    scene = load(str(tmp_path / "waits.py"), SLOW)
    ran = Execution(scene, tmp_path / "runs").run()
    told, late = [trial.onset for trial in read(ran.folder).results], 2 * 0.0455
    for onset, asked in zip(told, (0.5, 0.0, 0.3), strict=True):
        assert asked <= onset <= asked + late, "set-points come every 45.5 ms"


def test_the_window_reads_the_same_drawings(made):
    report = write(made, read(made))
    (stored,) = json.loads(report.results.read_text())["plots"]
    plot, asked = Plot.from_dict(stored), report.findings.answers[0]
    assert plot.x_scale() == asked.x_scale()
    (series,), (own,) = plot.panels[0].series, asked.panels[0].series
    assert np.array_equal(series.x, own.x) and np.allclose(series.y, own.y)
    assert plot.to_dict() == stored


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("(trial,) = run.results", "(trial,) = 1 / 0", "ZeroDivisionError"),
        ("(trial,) = run.results", "raise SystemExit(7)", "SystemExit"),
        ("return Conclusion", "Conclusion", "return a Conclusion"),
        ('"fall_V": fall', '"fall_V": object()', "TypeError"),
        ("y=trace.mean,", "y=trace.mean[1:],", "give as many"),
        ('name="summary"', 'name="../summary"', "small letters"),
        ("run.trace(", "run.signal(", "AttributeError"),
    ],
)
def test_an_error_of_its_code_names_file_and_line_and_costs_nothing_else(
    made, tmp_path, old, new, says
):
    folder = kept(made, tmp_path, old, new)
    found = find(read(folder))
    (said,) = found.missing
    assert says in said
    if says not in ("return a Conclusion", "TypeError"):  # raised when it was done
        assert f"own.py, line {line_of(new, folder)}: " in said
    assert len(found.run.trials) == 1
    concluded, drawn = found.conclusion.sentences, found.answers
    assert bool(concluded) != bool(drawn), "the other one is kept"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("(said,", "(said[0],", r"line \d+: TypeError: sentences must be a tuple"),
        ('(("1", f"{fall:.3f}"),)', "((1, 2),)", r"line \d+: TypeError: rows must"),
        ('(("1", f"{fall:.3f}"),)', '(("1",),)', r"line \d+: TypeError: .*2 headings"),
        ("tables=(table,)", "tables=(rows,)", r"line \d+: TypeError: tables hold"),
        ("yield Plot(", "yield dict(", "TypeError: plots gave .*; yield a Plot"),
    ],
)
def test_what_cannot_be_shown_is_told_and_costs_nothing_else(
    made, tmp_path, old, new, says
):
    folder = kept(made, tmp_path, old, new)
    said = CliRunner().invoke(cli, ["report", str(folder)])
    assert said.exit_code == 0 and re.search(says, said.stderr)
    found = json.loads((folder / "results.json").read_text())
    assert bool(found["statements"]) != bool(found["plots"]), "the other one is kept"
    assert len(found["trials"]) == 1 and re.search(says, found["missing"][0])
    page = html.unescape((folder / "report.html").read_text(encoding="utf-8"))
    assert found["missing"][0] in page and (folder / "figure.png").exists()


@pytest.mark.parametrize(
    ("when", "bad", "kind"),
    [
        ("first", "int('x')", "ValueError"),
        ("later", "int('x')", "ValueError"),
        ("first", "raise SystemExit(7)", "SystemExit"),  # the program ended with 7
    ],
)
def test_trials_that_raise_are_refused_with_file_and_line(tmp_path, when, bad, kind):
    if when == "first":
        text = OWN.replace("        pulse =", f"        {bad}\n        pulse =", 1)
    else:
        hold = "hold=(0.1, 0.4))"
        text = OWN.replace(hold, f"{hold}\n        {bad}", 1)
    (tmp_path / "own.py").write_text(text)
    line = 1 + text[: text.index(bad)].count("\n")
    with pytest.raises(SceneError, match=rf"own.py, line {line}: {kind}"):
        Execution(load(str(tmp_path / "own.py"), SLOW), tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("old", "new"), [("yield Trial(", "yield dict("), ("yield Trial(", "return dict(")]
)
def test_trials_that_yield_no_trial_are_refused(tmp_path, old, new):
    (tmp_path / "own.py").write_text(OWN.replace(old, new))
    with pytest.raises(SceneError, match=r"own fails: TypeError: trials gave .*yield"):
        Execution(load(str(tmp_path / "own.py"), SLOW), tmp_path / "runs")


def test_trials_that_raise_on_the_bench_keep_the_run(tmp_path):
    """The plan's outcome is the model's: what is measured may still surprise."""
    text = OWN.replace("        yield Trial", "        seen = yield Trial").replace(
        "hold=(0.1, 0.4))",
        "hold=(0.1, 0.4))\n        seen.codes['V_C1'] if seen.codes else None\n"
        "        seen.codes and [][3]",
    )
    (tmp_path / "own.py").write_text(text)
    done = Execution(load(str(tmp_path / "own.py"), SLOW), tmp_path / "runs").run()
    line = 1 + text[: text.index("[][3]")].count("\n")
    assert done.off.verified
    assert f"own.py, line {line}: IndexError" in done.reason
    assert len(read(done.folder).trials) == 1


def test_a_series_needs_as_many_values_each():
    with pytest.raises(ParameterError, match=r"2 values of x.*\(3,\)"):
        Series(x=[1, 2], y=[1, 2], low=[0, 0, 0], high=[1, 1, 1])
    with pytest.raises(ParameterError, match="no panel"):
        Plot(name="a", caption="", x_label="", panels=())
    Panel(label="", series=(Series(x=[1.0], mark="ticks"),))


def test_nothing_above_the_protocols_knows_one_by_its_name():
    """What a protocol means and how it is drawn stands with it, and nowhere else."""
    import ast

    from tactile_lab.plugins import protocol_names

    root = Path(__file__).parents[2]
    # the scene of the verb and of the window's monitor, and the name of an icon
    allowed = {
        ("commands", "monitor"), ("engine", "monitor"), ("gui", "monitor"),
        ("gui", "repeat"),
        # the scenes that a first day leads through
        ("commands", "wiring_check"), ("commands", "calibrate_field"),
        ("commands", "force_check"), ("commands", "threshold_search"),
    }  # fmt: skip
    found = set()
    for room in ("report", "analysis", "commands", "engine", "../gui"):
        for file in (root / "tactile_lab" / room).resolve().rglob("*.py"):
            tree = ast.parse(file.read_text(encoding="utf-8"))
            nodes = list(ast.walk(tree))
            beyond = [  # what a calibration does there: it holds its last value
                n.value
                for n in nodes
                if isinstance(n, ast.keyword) and n.arg == "beyond"
            ]
            found |= {
                (Path(room).name, n.value, file.name)
                for n in nodes
                if isinstance(n, ast.Constant) and n not in beyond
                if n.value in protocol_names()
            }
    assert not [f for f in found if f[:2] not in allowed]
