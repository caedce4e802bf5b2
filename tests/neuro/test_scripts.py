"""Scripts that play spikes into simulators do, when they are run by one."""

import numpy as np
import pytest

from tactile_lab.neuro.formats import write
from tactile_lab.neuro.of_run import events_of
from tactile_lab.neuro.scripts import script


@pytest.mark.parametrize("simulator", ["brian2", "nest"])
def test_all_spikes_are_played_at_their_times(
    events, simulator, simulate_script, tmp_path
):
    made, spikes = write(events, tmp_path / f"ball.{simulator}.py")
    assert spikes.name == "ball.spikes.npz"
    told = simulate_script(made)
    assert f"{events.time.size} spikes played from 12 taxels" in told
    if simulator == "nest":
        within = float(told.split("within ")[1].split(" ns")[0])
        assert within < 1e-3


def test_a_run_plays_as_one_taxel(run, simulate_script, tmp_path):
    made, _ = write(events_of(run), tmp_path / "run.nest.py")
    assert "spikes played from 1 taxels" in simulate_script(made)


def test_the_tensor_of_snntorch_has_every_spike(events, tmp_path, monkeypatch):
    """torch is too large for these tests: the script up to where it begins."""
    made, _ = write(events, tmp_path / "ball.snntorch.py")
    compile(made.read_text(), str(made), "exec")
    before = script("snntorch").split("taxels = torch")[0]
    before = before.replace("import snntorch\nimport torch\n", "")
    names = {"__file__": str(made)}
    exec(before, names)
    assert np.array_equal(names["spikes"].sum(axis=0), events.count)
