"""The first day works whole on the simulated bench, and goes on where it was."""

import json
import re

import click
import pytest

from tactile_lab import cli
from tactile_lab.commands import day_one
from tactile_lab.scene.load import load_bench

VERB = day_one._verb

SHORT = {
    "wiring_check": ("protocol.hold=0.5 s",),
    "calibrate_field": (
        "protocol.points=5",
        "protocol.dwell=0.2 s",
        "protocol.loops=1",
        "record.sample_rate=1 kS/s",
    ),
    "force_check": (
        'protocol.levels=["40 mN"]',
        "protocol.hold=0.5 s",
        "record.sample_rate=1 kS/s",
    ),
    "threshold_search": (
        "protocol.hold=0.5 s",
        "protocol.resolution=30 mN",
        'record.signals=["spikes"]',
        "record.sample_rate=500 kS/s",
    ),
    "demo": (
        'protocol.levels=["150 mN"]',
        "protocol.hold=0.5 s",
        'record.signals=["spikes"]',
        "record.sample_rate=500 kS/s",
    ),
}
ASKED = tuple(
    word
    for step, changes in SHORT.items()
    for change in changes
    for word in ("--set", f"{step}:{change}")
)


@pytest.fixture
def first_day(tactile_lab, tmp_path, monkeypatch):
    # they have tests of theirs
    monkeypatch.setattr(day_one, "_verb", lambda words: (f"asked {words[0]}\n", ""))

    def run(*arguments):
        return tactile_lab("day-one", "--out", tmp_path / "day", *ASKED, *arguments)

    return run


def test_the_first_day_ends_with_bench_calibration_and_page(first_day, tmp_path):
    swapped = 'wiring_check:simulated.swapped=["V_C1", "V_C2"]'
    stopped = first_day("--bench", "sim", "--set", swapped)
    assert stopped.code == 1, stopped.err
    assert "WRONG: not as wired: V_C1" in stopped.out
    assert "what to do: the report names" in stopped.out
    held = json.loads((tmp_path / "day" / "day-one.json").read_text())
    assert list(held["done"]) == ["doctor", "devices"]

    done = first_day("--note", "operator=Ada")
    assert done.code == 0, done.err
    assert "Can this computer run an experiment?  done before" in done.out
    held = json.loads((tmp_path / "day" / "day-one.json").read_text())
    assert list(held["done"]) == [step.name for step in day_one.STEPS]
    spec = load_bench(tmp_path / "day" / "bench.toml")
    assert spec.magnet.calibration is not None
    demo = held["done"]["demo"]["run"]
    info = json.loads((tmp_path / "day" / demo / "run.json").read_text())
    assert info["notes"]["operator"] == "Ada"
    page = (tmp_path / "day" / "day-one.html").read_text()
    for step in day_one.STEPS:
        assert step.title.replace("'", "&#x27;") in page
    assert "Critical force: between" in page
    assert "asked devices" in page
    assert "KEPCO" in page
    assert "150 mN: " in page  # what the demo gave
    assert "protocol.hold=0.5 s" in page  # what was changed
    assert page.count("<figure>") == 5, "each run's figure is in the page"
    assert "file://" not in page
    assert " src=" not in page
    for link in re.findall(r' href="([^#"]*)"', page):
        assert (tmp_path / "day" / link).exists(), link

    runs = sorted((tmp_path / "day" / "runs").iterdir())
    assert first_day().code == 0
    assert sorted((tmp_path / "day" / "runs").iterdir()) == runs


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((), "Name your bench file with --bench"),
        (("--bench", "sim", "--redo", "dmeo"), 'did you mean "demo"'),
        (("--bench", "sim", "--set", "demo"), "write STEP:KEY=VALUE"),
        (("--bench", "none.toml"), "none.toml does not exist"),
    ],
)
def test_a_day_that_cannot_begin_is_refused(first_day, tmp_path, arguments, told):
    answer = first_day(*arguments)
    assert answer.code == 2
    assert told in answer.err
    assert not (tmp_path / "day").exists()


def test_what_a_verb_prints_is_shown_and_kept(first_day, capsys):
    with click.Context(cli.cli, info_name="tactile-lab"):
        printed, wrong = VERB(["plan", "none.toml"])
        assert wrong == "it ended with 2"
        printed, wrong = VERB(["runs", "--help"])
    assert "Usage" in printed
    assert not wrong
    assert capsys.readouterr().out == printed
