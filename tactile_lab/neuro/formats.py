"""The one table of formats that runs and skins are exported in.

Light: the command line reads it for its help. Each format's module has either ``size``
and ``export`` (a run with its signals) or ``write`` (spikes alone, of a run or skin).
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tactile_lab.errors import ParameterError, choices

if TYPE_CHECKING:
    from pathlib import Path

    from tactile_lab.skin.events import Events


@dataclass(frozen=True)
class Format:
    """One format.

    Attributes:
        ending: of an exported file's name.
        run: module that writes a run with its signals, in `tactile_lab.store.export`.
        spikes: module that writes spikes alone, in `tactile_lab.neuro`.
        script: whether it is a script that plays the spikes, with a file of them.
        fixed: what a run is written to beside its data, where it is not called like it.
    """

    ending: str
    run: str = ""
    spikes: str = ""
    script: bool = False
    fixed: str = ""

    def beside(self, run: str) -> str:
        """Name of the file or folder that a run of this name is written to."""
        return self.fixed or f"{run}{self.ending}"


FORMATS = {
    "csv": Format(".csv", run="csv", spikes="lines", fixed="csv"),
    "mat": Format(".mat", run="mat"),
    "netcdf": Format(".nc", run="netcdf"),
    "parquet": Format(".parquet", run="parquet", fixed="parquet"),
    "ro-crate": Format(".zip", run="ro_crate", fixed="ro-crate-metadata.json"),
    "nwb": Format(".nwb", run="nwb", spikes="nwb"),
    "neo": Format(".nix", spikes="neo"),
    "tonic": Format(".npy", spikes="tonic"),
    "aedat4": Format(".aedat4", spikes="aedat4"),
    "brian2": Format(".brian2.py", script=True),
    "nest": Format(".nest.py", script=True),
    "snntorch": Format(".snntorch.py", script=True),
}
"""By the name that ``export --to`` takes; `skin --export` goes by the ending."""
SPIKES = {name: one for name, one in FORMATS.items() if one.spikes or one.script}


def of_whole_run(name: str) -> Any:
    """The module that writes a run with its signals in this format; None if none."""
    found = FORMATS[name].run
    return (
        importlib.import_module(f"tactile_lab.store.export.{found}") if found else None
    )


CIRCUITS = (".brian2.py", ".nestml", ".nir")
"""Endings of files that ``simulate --export`` writes the circuit to."""


def format_of(file: Path) -> str:
    """The format of spikes that a file's ending names.

    Raises:
        ParameterError: no format has that ending.
    """
    names = {one.ending: name for name, one in SPIKES.items()}
    return names[_ending(file, names, "spikes")]


def circuit_format_of(file: Path) -> str:
    """Which of `CIRCUITS` a file's name ends with.

    Raises:
        ParameterError: none.
    """
    return _ending(file, CIRCUITS, "circuits")


def _ending(file: Path, known: Iterable[str], what: str) -> str:
    for ending in known:
        if file.name.endswith(ending) and file.name != ending:
            return ending
    raise ParameterError(
        f"{file}: no format of {what} ends so. {choices(file.suffix, known, 'Endings')}"
    )


def write(events: Events, file: Path, name: str | None = None) -> list[Path]:
    """Write spikes in a format, the one that the file's ending names unless given.

    Args:
        events: of a skin, or of a run by `of_run.events_of`.
        file: takes its name once it is whole.
        name: of the format, one of `SPIKES`.

    Returns:
        What was written.

    Raises:
        ParameterError: no such format, or one that cannot hold these.
        RunFolderError: the format's library is not installed.
        RecordingError: there is no room.
        OSError: it cannot be written.
    """
    from tactile_lab.whole_file import replacing, write_text

    name = name or format_of(file)
    one = SPIKES[name]
    if one.script:
        from tactile_lab.neuro.scripts import script, write_spikes

        spikes = file.with_name(file.name.removesuffix(one.ending) + ".spikes.npz")
        with replacing(spikes) as part:
            write_spikes(events, part)
            write_text(file, script(name))  # neither without the other
        return [file, spikes]
    module = importlib.import_module(f"tactile_lab.neuro.{one.spikes}")
    with replacing(file) as part:
        module.write(events, part)
    return [file]
