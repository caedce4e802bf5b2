"""``tactile-lab export``: a run, or the spikes of a skin, for other programs."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import fail, print_json, progress, reading, say
from tactile_lab.errors import ParameterError
from tactile_lab.neuro.formats import FORMATS, SPIKES, of_whole_run, write
from tactile_lab.trust import INFO

if TYPE_CHECKING:
    from tactile_lab.store.selection import Selection

LARGE = 100_000_000
"""Bytes that are announced beforehand wherever the output goes."""


@click.command()
@run_argument
@click.option("--to", "form", type=click.Choice(tuple(FORMATS)), required=True)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Folder (csv, parquet), file or .zip (ro-crate); beside the run's data unless "
    "given.",
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
    holds, and the settings. An RO-Crate describes the run's folder itself. Formats of
    spikes alone (neo, tonic, aedat4, and scripts for brian2, nest and snntorch) also
    take the folder of a skin, as csv and nwb do.
    """
    with reading(run):
        from tactile_lab.skin.events import FILE, WAITING
        from tactile_lab.store.selection import Selection

        selection = Selection(
            signals=signals or None,
            start=_quantity("--from", start, "s") or 0.0,
            end=_quantity("--until", end, "s"),
            rate=_quantity("--rate", rate, "S/s"),
        )
        try:
            if (run / FILE).exists() or any(run.glob(f"{WAITING}*")):
                written = _of_skin(run, form, out, selection)
            else:
                written = _of_run(run, form, out, selection)
        except OSError as error:
            if error.errno is None:
                raise  # HDF5 could not read
            # HDF5 puts addresses and more into the error's own text
            said = f"{out or run} cannot be written: {os.strerror(error.errno)}."
            fail(f"{said} Name another place with --out.", 2)
            return
    from tactile_lab.quantity import bytes_text

    if as_json:
        print_json({"run": str(run), "files": [str(file) for file in written]})
    else:
        for file in written:
            say(f"{file}  {bytes_text(file.stat().st_size)}")


def _of_run(run: Path, form: str, out: Path | None, selection: Selection) -> list[Path]:
    _refuse_study(run)
    from tactile_lab.neuro.of_run import events_of
    from tactile_lab.quantity import bytes_text
    from tactile_lab.store.folder import refuse_own
    from tactile_lab.store.run import Run

    target = out or run / FORMATS[form].beside(run.resolve().name)
    refuse_own(target)
    with Run.load(run) as loaded:
        selection.check(loaded)
        module = of_whole_run(form)
        if module is None:
            _refuse_samples(form, selection)
            with progress(f"writing {target.name}"):
                return write(events_of(loaded, selection), target, form)
        if selection.rate and loaded.samples:
            made = selection.told(loaded)["sample_rate_Hz"]
            if not math.isclose(made, selection.rate, rel_tol=1e-3):
                say(
                    f"averages of whole samples: {made:.6g} S/s, not "
                    f"{selection.rate:g} S/s",
                    sys.stderr,
                )
        size = module.size(loaded, selection)
        text = f"writing {target.name}, about {bytes_text(size)}"
        if size >= LARGE:
            say(text, sys.stderr)
        with progress(text) as update:
            written: list[Path] = module.export(loaded, target, selection, update, size)
    return written


def _refuse_study(folder: Path) -> None:
    """Say where a study has its numbers: it exports nothing itself."""
    if (folder / INFO).exists() or not folder.is_dir():
        return
    from tactile_lab.studies.dataset import DATA
    from tactile_lab.studies.points import RUNS

    data, runs = folder / DATA, list((folder / RUNS).glob(f"*/{INFO}"))
    if not data.exists() or runs:  # a run is asked for by its own refusal
        return
    raise ParameterError(
        f"{folder} is a study, and its numbers are in open files already: {DATA} "
        "(xarray.open_zarr) and results.json. It kept no run that could be exported; "
        'with on = "simulated" and runs = true in its file it keeps one of each point.'
    )


def _of_skin(
    skin: Path, form: str, out: Path | None, selection: Selection
) -> list[Path]:
    from tactile_lab.skin.events import Events

    if form not in SPIKES:
        raise ParameterError(
            f"{skin} is a skin and holds spikes only; choose --to {', '.join(SPIKES)}."
        )
    _refuse_samples(form, selection)
    if selection.start or selection.end is not None:
        raise ParameterError("A skin is exported whole; leave out --from and --until.")
    events = Events.read(skin)
    target = out or skin / f"{skin.resolve().name}{FORMATS[form].ending}"
    with progress(f"writing {target.name}, {len(events.time):,} spikes"):
        return write(events, target, form)


def _refuse_samples(form: str, selection: Selection) -> None:
    if selection.signals or selection.rate:
        raise ParameterError(
            f"{form} holds spikes alone; leave out --signal and --rate."
        )


def _quantity(option: str, text: str | None, unit: str) -> float | None:
    from tactile_lab.errors import QuantityError
    from tactile_lab.quantity import parse

    try:
        return None if text is None else parse(text, unit)
    except QuantityError as reason:
        raise QuantityError(f"{option}: {reason}") from reason
