"""``tactile-lab export``: a run for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import fail, print_json, refusing, say, working

FORMATS = ("csv", "mat", "nwb")


@click.command()
@run_argument
@click.option("--to", "form", type=click.Choice(FORMATS), required=True)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Folder (csv) or file (mat, nwb); beside the run's data unless given.",
)
@click.option("--signal", "signals", multiple=True, help="Only this one; repeatable.")
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
    """Export RUN as CSV (SI, units in the header), MATLAB or NWB file."""
    with refusing():
        from tactile_lab.store.run import Run
        from tactile_lab.store.selection import Selection

        selection = Selection(
            signals=signals or None,
            start=_quantity("--from", start, "s") or 0.0,
            end=_quantity("--until", end, "s"),
            rate=_quantity("--rate", rate, "S/s"),
        )
        target = out or run / (
            "csv" if form == "csv" else f"{run.resolve().name}.{form}"
        )
        with Run.load(run) as loaded, working(f"writing {target}"):
            try:
                written = _exporter(form)(loaded, target, selection)
            except OSError as error:
                fail(f"{target} cannot be written: {error.strerror or error}.", 2)
                return
    if as_json:
        print_json({"run": str(run), "files": [str(file) for file in written]})
    else:
        for file in written:
            say(str(file))


def _quantity(option: str, text: str | None, unit: str) -> float | None:
    from tactile_lab.errors import QuantityError
    from tactile_lab.quantity import parse

    try:
        return None if text is None else parse(text, unit)
    except QuantityError as reason:
        raise QuantityError(f"{option}: {reason}") from reason


def _exporter(form: str) -> Any:
    """The `export` of that format; loads only its own libraries."""
    import importlib

    return importlib.import_module(f"tactile_lab.store.export.{form}").export
