"""The command line answers at once, imports what a verb needs, and knows its verbs."""

import json
import os
import resource
import shlex
import subprocess
import sys

import click
import pytest
from loaded import loaded_after

from tactile_lab.cli import ALGEBRA, VERBS, cli, main

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


def test_plan_opens_nothing_and_draws_only_when_asked():
    names = loaded_after("plan", "v_c1_only")
    tops = {name.split(".")[0] for name in names}
    assert not tops & {"serial", "usb", "PySide6", "h5py", "matplotlib", "sim_backend"}
    assert not names & {"drivers.coil.source", "drivers.teslameter"}
    assert "tactile_lab.commands.one_run" not in names


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


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulat",),
        ("run", "--nonsense"),
        ("show",),
        ("plan", "nonsense"),
        ("export", "nonsense"),
    ],
)
def test_every_refusal_is_one_line_of_the_same_form(capsys, arguments):
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    assert end.value.code == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("tactile-lab: ")
    assert len(told.err.splitlines()) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is a display")
def test_the_window_without_a_display_says_so(capsys, monkeypatch):
    for display in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(display, raising=False)
    with pytest.raises(SystemExit) as end:
        main(["gui"])
    assert end.value.code == 1
    assert "needs a display" in capsys.readouterr().err


def completed(line, monkeypatch, capsys):
    """What bash would offer for the last word of `line`."""
    words = line.split(" ")
    monkeypatch.setenv("_TACTILE_LAB_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
    with pytest.raises(SystemExit):
        main([])
    return [offer.split(",")[1] for offer in capsys.readouterr().out.splitlines()]


def test_the_shell_completes_verbs_scenes_keys_and_runs(tmp_path, monkeypatch, capsys):
    def offered(line):
        return completed(line, monkeypatch, capsys)

    assert offered("tactile-lab val") == ["validate"]
    assert "hold_10s" in offered("tactile-lab run hol")
    assert offered("tactile-lab run hold_10s --set protocol.lev") == ["protocol.level="]
    monkeypatch.chdir(tmp_path)
    for place in ("runs/2026-01-01_demo", "runs/2026-01-02_demo", "runs/other"):
        (tmp_path / place).mkdir(parents=True)
        if "demo" in place:
            (tmp_path / place / "run.json").touch()
    newest_first = ["runs/2026-01-02_demo", "runs/2026-01-01_demo"]
    assert offered("tactile-lab show ") == newest_first
    assert offered("tactile-lab verify runs/2026-01-02") == newest_first[:1]


@pytest.mark.skipif(os.name != "posix", reason="a POSIX shell closes them")
@pytest.mark.parametrize("closed", ["<&-", ">&-", "<&- >&- 2>&-"])
def test_streams_that_were_closed_before_the_start(tmp_path, closed):
    """As a service may start it; on Windows pythonw has none at all."""
    verb = f"run v_c1_only --no-report --set record.sample_rate='20 kS/s' {closed}"
    command = f"{shlex.quote(sys.executable)} -m tactile_lab {verb}"
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, check=False)
    assert done.returncode == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert json.loads((run / "run.json").read_text())["status"] == "complete"


def test_linear_algebra_takes_one_thread_unless_asked_for_more(tmp_path):
    """Of two, on busy cores, each waits for the other far longer than it works."""
    told = (
        "import atexit; from threadpoolctl import threadpool_info;"
        "atexit.register(lambda: print({one['num_threads'] for one in"
        " threadpool_info() if one['user_api'] == 'blas'}));"
        "from tactile_lab.cli import main; main(['plan', 'demo'])"
    )
    bare = {name: v for name, v in os.environ.items() if name not in ALGEBRA}
    for asked, threads in (({}, 1), ({"OPENBLAS_NUM_THREADS": "2"}, 2)):
        done = subprocess.run(
            [sys.executable, "-c", told], capture_output=True, text=True,
            cwd=tmp_path, env=bare | asked, check=True,
        )  # fmt: skip
        assert done.stdout.splitlines()[-1] == f"{{{threads}}}"
