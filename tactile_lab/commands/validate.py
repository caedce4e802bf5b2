"""``tactile-lab validate``: the solver against other solvers, truth and extremes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from tactile_lab.commands.terminal import refusing, say

WRONG = 1


@click.group()
def command() -> None:
    """Measure the solver of the model; each report states commit, date and machine."""


out_option: Callable[..., Any] = click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write the report there, not to stdout.",
)


def cap_option(default: float) -> Callable[..., Any]:
    """How long another solver may take."""
    return click.option(
        "--cap",
        type=click.FloatRange(0, min_open=True),
        default=default,
        show_default=True,
        help="Most CPU time per solver, s.",
    )


@command.command()
@out_option
@cap_option(20.0)
@click.option("--scene", "names", multiple=True, metavar="NAME", help="Only this one.")
@click.option(
    "--repeats",
    type=click.IntRange(1),
    default=3,
    show_default=True,
    help="Timings; least counts.",
)
@click.option("--compiled", is_flag=True, help="Leave out those called from Python.")
def accuracy(
    out: Path | None, names: tuple[str, ...], cap: float, repeats: int, compiled: bool
) -> None:
    """Error against run time: ours and other solvers, nine scenes easy to stiff.

    Truth is a 40-digit reference. Dormand-Prince, Rodas5P, Euler and RK4 are compiled
    whole, as ours is. CVODE (scikit-sundae) and ngspice take part where they are
    installed.
    """
    with refusing():
        from tactile_lab.validation.accuracy import compete, figure, report, write_csv

        scenes, rows = compete(names, repeats, cap, _say, called=not compiled)
        _write(report(scenes, rows, cap), out, "accuracy.md")
        if out is not None:
            write_csv(rows, out / "accuracy.csv")
            figure(rows, out / "accuracy.svg")
            say(f"Wrote accuracy.csv and accuracy.svg to {out}.")


@command.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    metavar="DIR",
    help="Write sweeps.md, sweeps.csv and sweeps.svg there.",
)
@cap_option(5.0)
def sweeps(out: Path, cap: float) -> None:
    """Time and error as stiffness, grazing and the number of spikes grow."""
    with refusing():
        from tactile_lab.validation.sweeps import sweep, write

        write(sweep(cap, 5, _say), cap, out)
        say(f"Wrote {out / 'sweeps.md'}, sweeps.csv and sweeps.svg.")


@command.command()
@out_option
@click.option(
    "--scenes",
    type=click.IntRange(1),
    default=100,
    show_default=True,
    metavar="N",
    help="How many; a fifth as many with T1 saturated.",
)
def honesty(out: Path | None, scenes: int) -> None:
    """Is the error estimate above the true error, on random scenes and parameters?

    With --out, what is measured is kept in honesty.csv: a campaign that was stopped
    goes on where it was, unless the solver has changed since.
    """
    with refusing():
        from tactile_lab.validation.honesty import campaign, report, scatter

        rows = campaign(scenes, out, _say)
        _write(report(scenes, rows), out, "honesty.md")
        if out is not None:
            scatter(rows, out / "honesty.svg")
            say(f"Wrote honesty.svg to {out}.")


@command.command()
@out_option
@cap_option(3.0)
@click.option("--case", "names", multiple=True, metavar="TEXT", help="Only these.")
@click.option("--ours", "alone", is_flag=True, help="Leave the other solvers out.")
def stability(
    out: Path | None, names: tuple[str, ...], cap: float, alone: bool
) -> None:
    """Extreme cases: right, wrong, NaN or timed out; exit code 1 if ours ever fails."""
    with refusing():
        from tactile_lab.validation.stability import report

        text, bad = report(names, cap, not alone, _say)
        _write(text, out, "stability.md")
    if bad:
        raise click.exceptions.Exit(WRONG)


def _write(text: str, out: Path | None, name: str) -> None:
    if out is None:
        say(text)
        return
    from tactile_lab.whole_file import write_text

    write_text(out / name, text)
    say(f"Wrote {out / name}.")


def _say(text: str) -> None:
    say(text, sys.stderr)
