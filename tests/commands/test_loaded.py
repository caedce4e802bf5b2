"""What a run does not need is not imported."""

import os

import pytest
from loaded import force_only, force_simulated, simulated, spikes_only


def rooms(names):
    return {name.partition(".")[0] for name in names}


@pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")
def test_a_run_of_force_alone_loads_a_source_and_nothing_else(tmp_path):
    names = force_only(tmp_path)
    assert "drivers.coil.source" in names
    assert not rooms(names) & {"usb", "numba", "sim_backend", "gui", "matplotlib"}
    assert not names & {"drivers.teslameter", "drivers.picoscope", "drivers.usbtmc"}
    assert not names & {"tactile_lab.model.solver", "tactile_lab.spikes.detector"}


def test_a_simulated_run_of_force_alone_loads_no_compiled_code(tmp_path):
    """Neither the sensor's model nor the scope's converter has anything to do."""
    names = force_simulated(tmp_path)
    assert "sim_backend.plant.plant" in names
    assert "numba" not in names
    assert not names & {"sim_backend.plant.render", "tactile_lab.model.solver"}


def test_a_run_of_spikes_alone_loads_no_teslameter(tmp_path):
    names = spikes_only(tmp_path)
    assert {"drivers.picoscope.scope", "tactile_lab.spikes.detector"} <= names
    assert not rooms(names) & {"usb", "gui", "matplotlib"}
    assert not names & {"drivers.teslameter", "sim_backend.teslameter"}
    assert not names & {"drivers.usbtmc", "sim_backend.usbtmc"}
    assert not names & {"pylsl", "tactile_lab.engine.lsl"}
    assert "tactile_lab.commands.status_server" not in names


def test_the_model_alone_loads_no_bench(tmp_path):
    names = simulated(tmp_path)
    assert "tactile_lab.model.solver" in names
    assert not rooms(names) & {"drivers", "sim_backend", "serial", "usb", "h5py"}
    assert not rooms(names) & {"gui", "PySide6", "matplotlib"}
    assert "tactile_lab.acquisition" not in names and "tactile_lab.engine" not in names
