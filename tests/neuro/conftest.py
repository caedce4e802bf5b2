"""A small skin and a short run, computed once."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load
from tactile_lab.skin.events import Events
from tactile_lab.skin.press import press
from tactile_lab.skin.skin import load_skin
from tactile_lab.store.run import Run

BALL = {
    "title": "A ball",
    "duration": "0.6 s",
    "array": {"grid": [3, 4], "dead": [5]},
    "stimulus": [{"kind": "sphere", "force": "6 N", "start": "0.1 s", "hold": "0.4 s"}],
}


@pytest.fixture(scope="session")
def ball():
    return load_skin(BALL, name="ball")


@pytest.fixture(scope="session")
def skin_folder(ball, tmp_path_factory):
    folder = tmp_path_factory.mktemp("skins") / "ball"
    press(ball, folder)
    return folder


@pytest.fixture(scope="session")
def events(skin_folder):
    return Events.read(skin_folder)


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory):
    asked = (
        'protocol.levels=["200 mN"]', "protocol.hold=0.5 s", "protocol.rest=0.3 s",
        'record.signals=["V_K", "spikes"]', "record.sample_rate=100 kS/s",
    )  # fmt: skip
    done = Execution(load("demo", asked), tmp_path_factory.mktemp("runs")).run()
    assert done.exit_code == 0, done.reason
    return done.folder


@pytest.fixture
def run(run_folder):
    with Run.load(run_folder) as loaded:
        yield loaded


@pytest.fixture
def simulate_script(tmp_path):
    """Runs a script with Brian2 and NEST; gives what it printed."""
    simulators = Path(sys.prefix) / "simulators"
    if not simulators.exists() and "CI" not in os.environ:
        pytest.skip("`make test` installs Brian2 and NEST")
    # compiling takes longer than these scripts
    (tmp_path / "brian_preferences").write_text("codegen.target = 'numpy'\n")

    def run(script, *words):
        done = subprocess.run(
            [sys.executable, str(script), *words],
            cwd=tmp_path, capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": str(simulators)},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
