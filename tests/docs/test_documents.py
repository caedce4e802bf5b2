"""What the documents tell a reader to do is done here, as it stands."""

import contextlib
import io
import json
import re
import runpy
import shlex
import shutil
import sys
import tomllib
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib import pyplot

from tactile_lab.cli import cli

DOCS = Path(__file__).parents[2] / "docs"


def blocks(document, language):
    text = (DOCS / document).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.S)


@pytest.fixture
def tactile_lab(tmp_path, monkeypatch):
    """A verb as typed in a folder of the test's own; what it prints."""
    monkeypatch.chdir(tmp_path)

    def typed(*words):
        done = CliRunner().invoke(cli, words)
        assert done.exit_code == 0, done.output
        return done.stdout

    return typed


def test_the_tutorial_ends_with_a_fitted_time_constant(tmp_path, monkeypatch, capsys):
    file = str(DOCS / "tutorial" / "adaptation.py")
    monkeypatch.setattr(sys, "argv", [file, str(tmp_path / "runs")])
    runpy.run_path(file, run_name="__main__")
    match = re.search(r"time constant ([\d.]+) s", capsys.readouterr().out)
    assert match is not None
    assert 1 < float(match[1]) < 8
    (folder,) = (tmp_path / "runs").iterdir()
    found = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    fit = found["trials"][0]["adaptation"]["time_constant_s"]
    assert fit["value"] == pytest.approx(float(match[1]), abs=0.01)
    assert (folder / "report.html").exists()


def test_a_protocol_of_ones_own_runs_as_the_how_to_says(tmp_path, tactile_lab):
    (source,) = blocks("how-to/write-a-protocol.md", "python")
    (tmp_path / "tap.py").write_text(source, encoding="utf-8")
    assert "tap" in tactile_lab("plan", "tap.py")
    said = tactile_lab(
        "run", "tap.py", "--set", 'protocol.step="10 mN"', "--json", "--out", "runs"
    )
    result = json.loads(said)
    assert result["status"] == "complete"
    trials = json.loads((tmp_path / result["run"] / "results.json").read_text())[
        "trials"
    ]
    assert [t["spikes"] > 0 for t in trials] == [False] * (len(trials) - 1) + [True]
    levels = [t["level_N"] for t in trials]
    assert levels[1] - levels[0] == pytest.approx(0.01)
    found = json.loads((tmp_path / result["run"] / "results.json").read_text())
    assert found["conclusion"]["answered_N"] == pytest.approx(levels[-1] - 0.005)
    assert [row[0] for row in found["tables"][0]["rows"]] == [
        t["label"] for t in trials
    ]
    page = (tmp_path / result["run"] / "report.html").read_text(encoding="utf-8")
    assert found["statements"][0] in page
    assert found["plots"][0]["caption"] in page
    assert (tmp_path / result["run"] / "summary.png").exists()


def test_the_scene_of_the_how_to_is_one(tmp_path, tactile_lab):
    (source,) = blocks("how-to/write-a-protocol.md", "python")
    (tmp_path / "tap.py").write_text(source, encoding="utf-8")
    (scene,) = blocks("how-to/write-a-protocol.md", "toml")
    (tmp_path / "taps.toml").write_text(scene, encoding="utf-8")
    assert "tap" in tactile_lab("plan", "taps.toml")


SCRIPTING = "how-to/script-in-python.md"
SAID = (
    r"0\.12 N: \d+ spikes in runs", r"12\.8 s, 0\.90 A",
    r"<Run of hold_10s: complete", r"V_C1 +I_DS +rate", r"^\d+ \d\.\d+e-\d+",
    r"^tau ", r"V_C1 ",
)  # fmt: skip


def test_each_example_of_the_scripting_how_to_is_expected_to_say_something():
    assert len(blocks(SCRIPTING, "python")) == len(SAID)


@pytest.mark.parametrize("number", range(len(SAID)))
def test_each_example_of_the_scripting_how_to_stands_alone(
    tmp_path, monkeypatch, capsys, number
):
    monkeypatch.chdir(tmp_path)
    exec(blocks(SCRIPTING, "python")[number], {"__name__": "__main__"})
    said = capsys.readouterr().out
    assert re.search(SAID[number], said, flags=re.M), said
    if number == 5:
        tau = float(re.search(r"^tau ([\d.]+)", said, flags=re.M)[1])
        assert tau == pytest.approx(8.69, rel=0.1)


@pytest.fixture(scope="module")
def readme_s(tmp_path_factory):
    """Folder in which the README's Python has run, and what it printed."""
    folder, said = tmp_path_factory.mktemp("readme"), io.StringIO()
    (source,) = blocks("../README.md", "python")
    matplotlib.use("Agg")
    with contextlib.chdir(folder), contextlib.redirect_stdout(said):
        exec(source, {"__name__": "__main__"})
    return folder, said.getvalue()


def test_the_python_of_the_readme_runs(readme_s):
    assert len(pyplot.gcf().axes) == 3
    pyplot.close("all")
    assert "<Run of hold_10s: complete" in readme_s[1]


def test_the_how_to_analyse_a_run_is_true(readme_s, tmp_path, monkeypatch, capsys):
    page = "how-to/analyse-a-run.md"
    run, *further = "".join(blocks(page, "sh")).splitlines()
    # which is the run that the README has made
    assert run == 'tactile-lab run hold_10s --out runs --set protocol.level="180 mN"'
    shutil.copytree(readme_s[0] / "runs", tmp_path / "runs")
    monkeypatch.chdir(tmp_path)
    volts = np.linspace(0, 2.75, 56)
    amperes = 1.216e-12 * np.exp(volts / (5.646 * 0.025))
    rows = "\n".join(f"{v},{i}" for v, i in zip(volts, amperes, strict=True))
    (tmp_path / "curve.csv").write_text(f"VG,ID\n{rows}\n", encoding="utf-8")
    said = ""
    for command in further:
        verb, *rest = shlex.split(command)[1:]
        found = [
            str(path) for part in rest
            for path in (sorted(tmp_path.glob(part)) if "*" in part else [part])
        ]  # fmt: skip
        done = CliRunner().invoke(cli, [verb, *found])
        assert done.exit_code == 0, done.output
        said += done.stdout
    assert (tmp_path / "report" / "twin.pdf").exists()
    assert (tmp_path / "transfer.png").exists()
    assert re.search(r"V_GS +1\.\d+ ", said)
    assert "time constant of" in said
    exec("\n".join(blocks(page, "python")), {})
    assert re.search(r"V_C1: [\d.]+ mV rms, \d+%", capsys.readouterr().out)


def test_the_page_of_the_architecture_draws_the_layers_that_are_checked() -> None:
    settings = (DOCS.parent / "pyproject.toml").read_text(encoding="utf-8")
    contracts = tomllib.loads(settings)["tool"]["importlinter"]["contracts"]
    (layers,) = [
        c["layers"] for c in contracts if c.get("containers") == ["tactile_lab"]
    ]
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    assert "\n".join(layers) in page


def test_all_places_that_the_page_of_the_architecture_names_are_there() -> None:
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    rooms = "tactile_lab|gui|drivers|sim_backend|protocols"
    named = re.findall(rf"`((?:{rooms})/[\w/]*(?:\.py)?)`", page)
    missing = [place for place in named if not (DOCS.parent / place).exists()]
    assert len(named) > 40 and not missing


def test_the_skin_of_its_page_is_pressed_and_its_python_runs(tmp_path, tactile_lab):
    (toml,) = blocks("skin.md", "toml")
    (tmp_path / "ball.toml").write_text(toml, encoding="utf-8")
    assert "256 taxels" in tactile_lab("skin", "ball.toml", "--plan")
    (source,) = blocks("skin.md", "python")
    exec(source, {"__name__": "__main__"})


def test_the_circuit_of_a_taxel_is_written_as_its_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (source,) = blocks("neuromorphic.md", "python")
    exec(source, {})
    written = {file.name for file in tmp_path.iterdir()}
    assert written == {
        "taxel.brian2.py", "taxel.nestml", "taxel.nir", "taxel.force.npz",
    }  # fmt: skip


def test_a_design_that_the_readme_names_is_there_and_is_the_one_explained():
    """It named light.toml, which stood only within a page."""
    (shown, *_) = blocks("how-to/choose-parts.md", "toml")
    assert (DOCS / "how-to/light.toml").read_text(encoding="utf-8") == shown
    for page in ("../README.md", "how-to/choose-parts.md"):
        text = (DOCS / page).read_text(encoding="utf-8")
        assert "tactile-lab design docs/how-to/light.toml" in text
