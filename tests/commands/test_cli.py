"""The command line answers at once, imports what a verb needs, and knows its verbs."""

import json
import os
import resource
import subprocess
import sys

import click
import pytest

from tactile_lab.cli import VERBS, cli, main

HEAVY = {
    "numpy",
    "scipy",
    "numba",
    "h5py",
    "PySide6",
    "pyqtgraph",
    "serial",
    "usb",
    "matplotlib",
    "pydantic",
}


def loaded_after(*arguments: str) -> set[str]:
    """Top-level modules loaded by one command line, in a process of its own."""
    code = (
        "import contextlib, io, json, sys\n"
        "from tactile_lab.cli import main\n"
        "with contextlib.redirect_stdout(io.StringIO()):\n"
        "    try: main(sys.argv[1:])\n"
        "    except SystemExit as end: assert end.code == 0, end.code\n"
        "print(json.dumps(sorted(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout))


def test_help_loads_nothing_heavy():
    tops = {name.split(".")[0] for name in loaded_after("--help")}
    assert not tops & HEAVY


@pytest.mark.parametrize("verb", ["plan", "simulate"])
def test_the_help_of_a_verb_loads_nothing_heavy(verb):
    tops = {name.split(".")[0] for name in loaded_after(verb, "--help")}
    assert not tops & HEAVY


def test_help_answers_in_under_300_ms():
    # processor time: what it takes does not depend on what else this machine does
    took = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [sys.executable, "-m", "tactile_lab", "--help"],
            stdout=subprocess.DEVNULL,
            check=True,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
        if took[-1] < 0.3:
            break
    assert min(took) < 0.3


def test_help_names_every_verb(capsys):
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    shown = capsys.readouterr().out
    assert all(verb in shown for verb in VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_in_the_table_has_its_command(verb):
    command = cli.get_command(click.Context(cli), verb)
    assert isinstance(command, click.Command)


def test_an_unknown_verb_names_the_nearest(capsys):
    with pytest.raises(SystemExit) as end:
        main(["simulat"])
    assert end.value.code == 2
    told = capsys.readouterr()
    assert 'Did you mean "simulate"' in told.err
    assert told.out == ""


def test_simulate_opens_no_bench():
    names = loaded_after("simulate", "spikes_only")
    tops = {name.split(".")[0] for name in names}
    assert not tops & {"serial", "usb", "PySide6", "h5py", "matplotlib", "sim_backend"}
    assert "drivers" not in tops
    assert "tactile_lab.acquisition" not in names


def test_plan_opens_nothing_and_draws_only_when_asked():
    names = loaded_after("plan", "v_c1_only")
    tops = {name.split(".")[0] for name in names}
    assert not tops & {"serial", "usb", "PySide6", "h5py", "matplotlib", "sim_backend"}
    assert not names & {"drivers.coil.source", "drivers.teslameter"}


def test_a_pipe_that_lacks_our_characters_is_no_error():
    done = subprocess.run(
        [sys.executable, "-m", "tactile_lab", "plan", "v_c1_only"],
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert b"channel A: V_C1" in done.stdout


def test_ctrl_c_has_its_code(monkeypatch, capsys):
    def interrupted(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("tactile_lab.scene.load.load", interrupted)
    with pytest.raises(SystemExit) as end:
        main(["simulate"])
    assert end.value.code == 130
    assert "Traceback" not in capsys.readouterr().err
