"""``tactile-lab identify``: fit parameters of the sensor to one or several runs."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import (
    print_json,
    progress,
    reading,
    say,
    warn,
    working,
)

if TYPE_CHECKING:
    from tactile_lab.analysis.identify import Identified
    from tactile_lab.report.identified import FittedRuns


@click.command()
@run_argument
@click.argument("words", nargs=-1, required=True, metavar="[RUN]... PARAMETERS...")
@click.option(
    "--force-scales",
    is_flag=True,
    help="Of several runs, fit a factor of each one's force as well.",
)
@json_option
def command(
    run: Path, words: tuple[str, ...], force_scales: bool, as_json: bool
) -> None:
    """Fit PARAMETERS (such as V_GS tau) to V_C1 and the spikes of RUN.

    The others keep the values of the run's scene. Several runs are fitted together, by
    one set of parameters, and each alone beside it. Warns of parameters that the runs
    do not determine, and of runs that do not agree.
    """
    folders = [run, *(Path(w) for w in words if _is_run(w))]
    parameters = tuple(word for word in words if not _is_run(word))
    with ExitStack() as stack:
        for one in folders:
            stack.enter_context(reading(one))
        from tactile_lab.errors import ParameterError
        from tactile_lab.report.from_run import read
        from tactile_lab.report.identified import identify_runs
        from tactile_lab.store.progress import each

        if not parameters:
            raise ParameterError("Name what to fit after the runs, such as V_GS.")
        if force_scales and len(folders) == 1:
            raise ParameterError(
                "--force-scales tells the forces of several runs apart; of one run fit "
                "g31 instead."
            )
        with progress("reading the runs") as update:
            data = [read(one, part) for one, part in each(folders, update)]
        with working("fitting"):
            found = identify_runs(data, parameters, force_scales=force_scales)
    if as_json:
        alone = {name: one and answer(one) for name, one in found.alone.items()}
        told = answer(found.together) | {"warnings": list(found.warnings)}
        print_json(told | {"runs": alone if len(alone) > 1 else None})
        return
    _print(found)


def _is_run(word: str) -> bool:
    """Whether a word is a run's folder, and no parameter."""
    return not word.isidentifier() or Path(word).is_dir()


def _print(found: FittedRuns) -> None:
    from tactile_lab.analysis.identify import unit_of

    together = found.together
    many = len(found.alone) > 1
    for name, estimate in together.estimates.items():
        unit = unit_of(name)
        say(f"{name:8} {estimate.shown(unit)}")
        for run, one in found.alone.items() if many else ():
            if one is None:
                say(f"    {run} alone cannot tell")
            elif name in one.estimates:
                say(f"    {run} alone {one.estimates[name].shown(unit)}")
    if together.scatter_V_C1 is not None:
        say(
            f"V_C1 is left with {together.scatter_V_C1 * 1e3:.2g} mV of scatter. The "
            "intervals hold noise, one code of offset of its channel, its converter's "
            "steps, the clocks, and what the bench states of followers, lag, force and "
            "temperature"
            + (", each the same in all runs." if many else ".")
            + " What is not fitted counts as exact."
        )
        if "tau" in together.estimates and "V_GS" not in together.estimates:
            say("A few uV of V_GS move tau by more than that: fit V_GS as well.")
    if together.noise:
        say(together.noise)
    for text in found.warnings:
        warn(text)


def answer(found: Identified) -> dict[str, Any]:
    """The object printed by ``--json``; SI units."""
    return {
        "parameters": {
            name: estimate.to_dict() for name, estimate in found.estimates.items()
        },
        "correlation": found.correlation.tolist(),
        "scatter_V_C1_V": found.scatter_V_C1,
        "scatter_V_fire_V": found.scatter_V_fire,
        "warnings": list(found.warnings),
    }
