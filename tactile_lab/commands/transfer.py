"""``tactile-lab transfer``: I_S, m and swing from a transfer curve (Fig. 1c)."""

from __future__ import annotations

from pathlib import Path

import click

from tactile_lab.commands.options import json_option
from tactile_lab.commands.terminal import print_json, refusing, say, warn


@click.command()
@click.argument("curve", type=click.Path(path_type=Path))
@click.option(
    "--between",
    nargs=2,
    metavar="LOW HIGH",
    help='V_GS to fit, by a line without leakage: --between "0.5 V" "2.5 V".',
)
@click.option(
    "--figure",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Draw curve and fit as FILE.png and FILE.svg.",
)
@json_option
def command(
    curve: Path, between: tuple[str, str] | None, figure: Path | None, as_json: bool
) -> None:
    """Fit the subthreshold regime of CURVE, a CSV of V_GS and I_DS in SI units.

    A line names the columns, such as "V_GS_V,I_DS_A", "VG,ID" or Keithley's
    "GateV,DrainI"; others, and settings above as EasyEXPERT writes them, are passed
    over.
    """
    with refusing():
        from tactile_lab.analysis.transfer import fit_transfer
        from tactile_lab.analysis.transfer_file import read_transfer
        from tactile_lab.model.temperature import VOLT_PER_KELVIN
        from tactile_lab.quantity import parse, show

        limits = None
        if between is not None:
            limits = (parse(between[0], "V"), parse(between[1], "V"))
        read = read_transfer(curve)
        if read.left_out:
            where = ", ".join(map(str, read.left_out[:5]))
            more = ", ..." if len(read.left_out) > 5 else ""
            warn(
                f"{curve}: rows without a number are left out: {len(read.left_out)} "
                f"(line {where}{more})"
            )
        fit = fit_transfer(read.V_GS, read.I_DS, between=limits)
        if figure is not None:
            from tactile_lab.errors import SceneError
            from tactile_lab.report.canvas import draw, save
            from tactile_lab.report.transfer import transfer_plot
            from tactile_lab.whole_file import failing_as

            plot = draw(transfer_plot(read, fit), "Transfer curve", curve.name)
            with failing_as(f"{figure} cannot be written", kind=SceneError):
                save(plot, figure)
    found = {"I_S_A": fit.I_S, "m": fit.m, "swing_V_per_decade": fit.swing}
    if as_json:
        print_json(
            {
                **{name: estimate.to_dict() for name, estimate in found.items()},
                "points": fit.points,
                "lines_left_out": list(read.left_out),
                "between_V": list(fit.range),
                "scatter": fit.scatter,
                "leakage_A": fit.leakage,
                "V_T_V": fit.V_T,
            }
        )
        return
    for name, told in (
        ("I_S", fit.I_S.shown("A")),
        ("m", fit.m.text("")),
        ("swing", fit.swing.text("mV/decade", 1e3)),
    ):
        say(f"{name:6} {told}")
    low, high = fit.range
    beside = "" if fit.leakage is None else f", {show(fit.leakage, 'A', 2)} beside it"
    say(f"from {fit.points} points between {low:g} V and {high:g} V{beside}")
    kelvin = fit.V_T / VOLT_PER_KELVIN
    say(
        f"m is for V_T = {show(fit.V_T, 'V')}, Table 1's, which is {kelvin:.1f} K; at "
        "another temperature it is as many times smaller as V_T is larger. Swing and "
        "I_S rest on no V_T."
    )
