"""``tactile-lab report``: figure, page and numbers of a run, again from its data."""

from __future__ import annotations

from pathlib import Path

import click

from tactile_lab.commands.options import run_argument
from tactile_lab.commands.terminal import print_json, progress, reading, say, warn

READ = 0.3
"""Part of the work until the run is read."""


@click.command()
@run_argument
@click.option("--pdf", is_flag=True, help="Also write the figures as PDF.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to write into; the run's own unless given.",
)
@click.option("--json", "as_json", is_flag=True, help="Print results.json to stdout.")
def command(run: Path, pdf: bool, out: Path | None, as_json: bool) -> None:
    """Write figure, report.html and results.json of RUN from its stored data."""
    with reading(run):
        from tactile_lab.errors import RunFolderError
        from tactile_lab.report.from_run import read
        from tactile_lab.report.results import results
        from tactile_lab.report.table import trials_table
        from tactile_lab.report.write import write
        from tactile_lab.store.progress import share

        folder = out or run
        try:
            with progress("writing the report") as update:
                data = read(run, share(update, 0.0, READ))
                folder.mkdir(parents=True, exist_ok=True)
                written = write(
                    folder, data, pdf=pdf, progress=share(update, READ, 1.0)
                )
        except OSError as reason:
            if reason.errno is None:
                raise  # HDF5 could not read
            raise RunFolderError(
                f"{folder} cannot be written: {reason.strerror}. Name another folder "
                "with --out."
            ) from reason
    for text in (*written.findings.run.warnings, *written.findings.missing):
        warn(text)
    if as_json:
        print_json(results(written.findings))
        return
    say(trials_table(written.findings.run).text)
    say()
    if text := written.findings.conclusion.text:
        say(f"{text}\n")
    say(f"figure  {written.png}")
    say(f"report  {written.html}")
