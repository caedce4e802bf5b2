"""Circuits written for other simulators give our spike trains there."""

import re

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli
from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.neuro.circuits import write
from tactile_lab.neuro.solved import Solved
from tactile_lab.waveform import Waveform

PUSH = Waveform(
    np.array([0.0, 0.02, 0.0303, 0.2, 0.2101]), np.array([0.0, 0.0, 0.15, 0.15, 0.25])
)


def solved(force=PUSH, until=0.3, **parts):
    return Solved.of(Circuit(**parts), force, until)


def test_brian2_gives_our_spikes_within_its_step(simulate_script, tmp_path):
    one = solved(firing="put")
    script, _ = write(one, tmp_path / "sensor.brian2.py")
    told = simulate_script(script, "2e-4")
    count = one.result.spike_times.size
    assert f"{count} spikes in steps of 0.0002 s, {count} by Tactile Lab" in told
    apart = float(re.search(r"at most (\S+) s apart", told)[1])
    assert count > 4 and apart < 4e-6  # spikes are located inside a step


def test_the_direct_branch_needs_no_derivative(tmp_path):
    one = solved(Waveform.constant(0.0), t1="direct", I_T1s=2.873e-20)
    for name in ("sensor.brian2.py", "sensor.nestml"):
        text = write(one, tmp_path / name)[0].read_text()
        compile(text, name, "exec") if name.endswith("py") else None
        assert "$" not in text and "R3*" not in text and "R3 *" not in text


def voltage(s, v, start, slope, tau):
    """A leaky integrator `s` seconds after `v`, towards a line from `start`."""
    return start + slope * (s - tau) + (v - start + slope * tau) * np.exp(-s / tau)


def last_stage(file):
    """Spikes of the LIF node of a NIR file under its current, exact between values."""
    node = pytest.importorskip("nir").read(file).nodes["last_stage"]
    with h5py.File(file) as opened:
        given = opened["input_current"]
        time, current = given["time"][:], given["current"][:]
        v, ours = float(given["V_C2"][()]), given["spikes"][:]
    tau, r = float(node.tau[0]), float(node.r[0])
    fire, reset = float(node.v_threshold[0]), float(node.v_reset[0])
    assert float(node.v_leak[0]) == 0.0
    spikes = []
    for t, end, a, b in zip(time, time[1:], current, current[1:], strict=False):
        slope = r * (b - a) / (end - t)
        start, left = r * a, end - t
        while voltage(left, v, start, slope, tau) >= fire:
            low, high = 0.0, left
            for _ in range(60):
                middle = (low + high) / 2
                below = voltage(middle, v, start, slope, tau) < fire
                low, high = (middle, high) if below else (low, middle)
            start, left, v = start + slope * high, left - high, reset
            spikes.append(end - left)
        v = voltage(left, v, start, slope, tau)
    return np.array(spikes), ours


def test_nir_gives_our_spikes_from_the_current_beside_it(tmp_path):
    one = solved()
    write(one, tmp_path / "sensor.nir")
    theirs, ours = last_stage(tmp_path / "sensor.nir")
    assert np.array_equal(ours, one.result.spike_times)
    assert theirs.size == ours.size > 4
    assert np.abs(theirs - ours).max() < 1e-6


def test_nir_has_no_time_of_reset(tmp_path):
    one = solved(firing="put")
    write(one, tmp_path / "sensor.nir")
    theirs, ours = last_stage(tmp_path / "sensor.nir")
    assert theirs.size == ours.size
    lag = ours - theirs
    assert lag[-1] == pytest.approx(8e-6 * (ours.size - 1), rel=0.3)


def test_nestml_says_the_circuit_in_its_units(tmp_path):
    model, force = write(solved(), tmp_path / "sensor.nestml")
    text = model.read_text()
    assert "R_L GOhm = 0.5 GOhm" in text and "C2 pF = 150.0 pF" in text
    assert "V_fire mV = 3213.0 mV" in text and "$" not in text
    assert "timestep()" not in text  # which NESTML compiles in `update` alone
    assert np.array_equal(np.load(force)["force"], PUSH.value)


def test_what_no_format_holds_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="leave saturation out"):
        solved(saturation=True)
    with pytest.raises(ParameterError, match=r"Endings: \.brian2\.py"):
        write(solved(), tmp_path / "sensor.xyz")


def test_simulate_writes_the_circuit_of_a_scene(tmp_path):
    ask = ["simulate", "--set", 'protocol.levels=["200 mN"]', "--set"]
    ask += ["protocol.hold=0.3 s", "--set", "protocol.rest=0.1 s", "--export"]
    done = CliRunner().invoke(cli, [*ask, str(tmp_path / "demo.nir")])
    assert done.exit_code == 0, done.output
    theirs, ours = last_stage(tmp_path / "demo.nir")
    assert theirs.size == ours.size > 0
    wrong = CliRunner().invoke(cli, [*ask, str(tmp_path / "demo.xml")])
    assert wrong.exit_code == 2 and "no format of circuits" in wrong.output
