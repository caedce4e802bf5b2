"""``tactile-lab identify``: fit parameters of the sensor to a run."""

from __future__ import annotations

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


@click.command()
@run_argument
@click.argument("parameters", nargs=-1, required=True)
@json_option
def command(run: Path, parameters: tuple[str, ...], as_json: bool) -> None:
    """Fit PARAMETERS (such as V_GS tau) to V_C1 and the spikes of RUN.

    The others keep the values of the run's scene. Warns of parameters that the run does
    not determine.
    """
    with reading(run):
        from tactile_lab.report.from_run import read
        from tactile_lab.report.identified import identify_run

        with progress("reading the run") as update:
            data = read(run, update)
        with working("fitting"):
            found = identify_run(data, parameters)
    if as_json:
        print_json(answer(found))
        return
    for name, estimate in found.estimates.items():
        say(
            f"{name:8} {estimate.value:.6g}  "
            f"({estimate.low:.6g} to {estimate.high:.6g}, 95 %)"
        )
    if found.scatter_V_C1 is not None:
        say(
            f"V_C1 is left with {found.scatter_V_C1 * 1e3:.2g} mV of scatter. The "
            "intervals hold noise, one code of offset of its channel, the clocks, and "
            "what the bench states of followers, lag and force."
        )
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
