"""``tactile-lab report``: figure, page and numbers of runs, from their data."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import click

from tactile_lab.commands.options import complete_runs
from tactile_lab.commands.terminal import print_json, progress, reading, say, warn

READ = 0.3
"""Part of the work until the run is read."""


@click.command()
@click.argument(
    "runs",
    metavar="RUN...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
    shell_complete=complete_runs,
)
@click.option("--pdf", is_flag=True, help="Also write the figures as PDF.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to write into; the run's own unless given, of several ./side-by-side.",
)
@click.option("--json", "as_json", is_flag=True, help="Print results.json to stdout.")
def command(runs: tuple[Path, ...], pdf: bool, out: Path | None, as_json: bool) -> None:
    """Write figure, report.html and results.json of RUN from its stored data.

    Of several runs, one page: what each found, rate against force, and each specimen
    with mean and standard error.
    """
    with ExitStack() as stack:
        for run in runs:
            stack.enter_context(reading(run))
        folder = out or (runs[0] if len(runs) == 1 else Path("side-by-side"))
        stack.enter_context(_writing(folder))
        if len(runs) == 1:
            _one(runs[0], folder, pdf=pdf, as_json=as_json)
        else:
            _several(runs, folder, pdf=pdf, as_json=as_json)


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as reason:
        from tactile_lab.errors import RunFolderError, TactileLabError

        if reason.errno is None or isinstance(reason, TactileLabError):
            raise  # HDF5 could not read
        raise RunFolderError(
            f"{folder} cannot be written: {reason.strerror}. Name another folder with "
            "--out."
        ) from reason


def _one(run: Path, folder: Path, *, pdf: bool, as_json: bool) -> None:
    from tactile_lab.report.from_run import read
    from tactile_lab.report.results import results
    from tactile_lab.report.table import trials_table
    from tactile_lab.report.write import write
    from tactile_lab.store.progress import share

    with progress("writing the report") as update:
        data = read(run, share(update, 0.0, READ))
        folder.mkdir(parents=True, exist_ok=True)
        written = write(folder, data, pdf=pdf, progress=share(update, READ, 1.0))
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


def _several(runs: tuple[Path, ...], folder: Path, *, pdf: bool, as_json: bool) -> None:
    from tactile_lab.report.several import SeveralRuns
    from tactile_lab.store.progress import share

    with progress("reading the runs") as update:
        found = SeveralRuns.of(runs, share(update, 0.0, 0.9))
        page = found.write(folder, pdf=pdf, progress=share(update, 0.9, 1.0))
    if as_json:
        print_json({"runs": found.to_dict(), "report": str(page)})
        return
    for text in found.sentences:
        say(text)
    say(f"\n{found.by_specimen.text}\n")
    say(found.table.text)
    say(f"\nreport  {page}")
