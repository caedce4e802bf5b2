"""The last stage, R_L, C2 and the firing, as a NIR graph with its input current.

NIR (Pedersen et al., Nature Communications 15, 2024) has no transistor, so of the
circuit only Eqs. (18), (10) and (11) go out, as a node LIF, with I_C of Eq. (17).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tactile_lab.neuro.solved import Solved
from tactile_lab.store.export.library import library

STEP = 1e-4
"""s between values of the current; between them it is linear."""


def graph(solved: Solved) -> Any:
    """A `nir.NIRGraph`: input, LIF, output; volts, amperes and seconds.

    NIR has no time of reset: t_eps is left out.

    Raises:
        RunFolderError: nir is not installed.
    """
    nir = library("nir")
    c = solved.circuit

    def one(value: float) -> Any:
        return np.array([value])

    stage = nir.LIF(
        tau=one(c.tau_L), r=one(c.R_L), v_leak=one(0.0),
        v_threshold=one(c.fire_voltage), v_reset=one(c.reset_voltage),
    )  # fmt: skip
    nodes = {
        "input": nir.Input(input_type={"input": np.array([1])}),
        "last_stage": stage,
        "output": nir.Output(output_type={"output": np.array([1])}),
    }
    edges = [("input", "last_stage"), ("last_stage", "output")]
    return nir.NIRGraph(nodes=nodes, edges=edges)


def write(solved: Solved, file: Path) -> None:
    """The graph as ``nir.read`` takes it; in the same file the group `input_current`.

    It holds `time` s, `current` A (I_C and I_bias), `V_C2` V at time 0, and `spikes` s.

    Raises:
        RunFolderError: nir is not installed.
    """
    nir = library("nir")
    nir.write(str(file), graph(solved))
    duration = solved.result.duration
    time = np.linspace(0.0, duration, round(duration / STEP) + 1)
    current = solved.result.sample("I_C", time) + solved.circuit.I_bias
    with h5py.File(file, "a") as opened:
        group = opened.create_group("input_current")
        group["time"], group["current"] = time, current
        group["V_C2"] = solved.first["V_C2"]
        group["spikes"] = solved.spikes
