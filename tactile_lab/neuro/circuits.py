"""A simulated circuit in the formats of neural simulators."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_lab.neuro import circuit_brian2, circuit_nestml, last_stage_nir
from tactile_lab.neuro.formats import circuit_format_of
from tactile_lab.neuro.solved import Solved
from tactile_lab.whole_file import replacing, write_text


def write(solved: Solved, file: Path) -> list[Path]:
    """Write the circuit, and for the texts the force on it and our spikes beside them.

    Args:
        solved: the circuit with its force and our answer.
        file: its ending says the format: .nir, .brian2.py or .nestml.

    Returns:
        What was written.

    Raises:
        ParameterError: no format of circuits ends so.
        RunFolderError: nir is not installed.
        RecordingError: there is no room.
        OSError: it cannot be written.
    """
    ending = circuit_format_of(file)
    if ending == ".nir":
        with replacing(file) as part:
            last_stage_nir.write(solved, part)
        return [file]
    module = circuit_brian2 if ending == ".brian2.py" else circuit_nestml
    force = file.with_name(file.name.removesuffix(ending) + ".force.npz")
    with replacing(force) as part, part.open("wb") as opened:
        np.savez_compressed(
            opened, time=solved.force.time, force=solved.force.value,
            duration=solved.result.duration, spikes=solved.spikes,
        )  # fmt: skip
    write_text(file, module.text(solved))
    return [file, force]
