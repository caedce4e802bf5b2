"""``tactile-lab export``: a run for other programs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import fail, print_json, progress, reading, say

FILES = {
    "csv": "csv",
    "mat": "{run}.mat",
    "netcdf": "{run}.nc",
    "nwb": "{run}.nwb",
    "parquet": "parquet",
    "ro-crate": "ro-crate-metadata.json",
}
"""What each format writes beside the run's data: a file, or a folder."""
LARGE = 100_000_000
"""Bytes that are announced beforehand wherever the output goes."""


@click.command()
@run_argument
@click.option("--to", "form", type=click.Choice(tuple(FILES)), required=True)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Folder (csv, parquet), file (mat, netcdf, nwb) or .zip (ro-crate); beside "
    "the run's data unless given.",
)
@click.option(
    "--signal",
    "signals",
    multiple=True,
    help="Only this one, stored or derived (force, rate, I_DS); repeatable.",
)
@click.option("--from", "start", metavar="TIME", help='Such as "2 s".')
@click.option("--until", "end", metavar="TIME", help='Such as "4.5 s".')
@click.option("--rate", metavar="RATE", help='Average down, such as "1 kS/s".')
@json_option
def command(
    run: Path,
    form: str,
    out: Path | None,
    signals: tuple[str, ...],
    start: str | None,
    end: str | None,
    rate: str | None,
    as_json: bool,
) -> None:
    """Export RUN for other programs, in SI units.

    Signals with the force, rate and I_DS derived from them, spikes, trials with their
    holds, and the settings. An RO-Crate describes the run's folder itself.
    """
    with reading(run):
        from tactile_lab.quantity import bytes_text
        from tactile_lab.store.run import Run
        from tactile_lab.store.selection import Selection

        selection = Selection(
            signals=signals or None,
            start=_quantity("--from", start, "s") or 0.0,
            end=_quantity("--until", end, "s"),
            rate=_quantity("--rate", rate, "S/s"),
        )
        target = out or run / FILES[form].format(run=run.resolve().name)
        exporter = _exporter(form)
        with Run.load(run) as loaded:
            selection.check(loaded)
            size = exporter.size(loaded, selection)
            text = f"writing {target.name}, up to {bytes_text(size)}"
            if size >= LARGE:
                say(text, sys.stderr)
            with progress(text) as update:
                try:
                    written = exporter.export(loaded, target, selection, update)
                except OSError as error:
                    if error.errno is None:
                        raise  # HDF5 could not read
                    fail(f"{target} cannot be written: {error.strerror}.", 2)
                    return
    if as_json:
        print_json({"run": str(run), "files": [str(file) for file in written]})
    else:
        for file in written:
            say(f"{file}  {bytes_text(file.stat().st_size)}")


def _quantity(option: str, text: str | None, unit: str) -> float | None:
    from tactile_lab.errors import QuantityError
    from tactile_lab.quantity import parse

    try:
        return None if text is None else parse(text, unit)
    except QuantityError as reason:
        raise QuantityError(f"{option}: {reason}") from reason


def _exporter(form: str) -> Any:
    """The module of that format, with `size` and `export`; loads its own libraries."""
    import importlib

    name = form.replace("-", "_")
    return importlib.import_module(f"tactile_lab.store.export.{name}")
