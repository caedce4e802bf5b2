"""``tactile-lab serve-bench``: the simulated serial instruments for other programs."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tactile_lab.commands.options import json_option
from tactile_lab.commands.terminal import print_json, refusing, say


@click.command()
@click.option("--coil", metavar="pty|tcp:PORT", help="Serve a current source there.")
@click.option("--teslameter", metavar="pty|tcp:PORT", help="Serve a teslameter there.")
@click.option(
    "--voltage-source",
    metavar="pty|tcp:PORT",
    help="Serve a source meter that holds V_GS there.",
)
@click.option(
    "--thermometer", metavar="pty|tcp:PORT", help="Serve a thermometer there."
)
@click.option(
    "--coil-dialect",
    default="kepco-bop",
    show_default=True,
    metavar="ROW|FILE",
    help="What the source speaks; a row of your own is served as it says.",
)
@click.option(
    "--teslameter-dialect",
    default="lakeshore-425",
    show_default=True,
    metavar="ROW|FILE",
    help="What the teslameter speaks.",
)
@click.option(
    "--voltage-dialect",
    default="keithley-2400-voltage",
    show_default=True,
    metavar="ROW|FILE",
    help="What the source meter speaks.",
)
@click.option(
    "--thermometer-dialect",
    default="lakeshore-218",
    show_default=True,
    metavar="ROW|FILE",
    help="What the thermometer speaks.",
)
@click.option("--baud", type=click.IntRange(50, 4_000_000), help="Of the source.")
@click.option(
    "--paced", is_flag=True, help="Let bytes take the time the baud rate gives them."
)
@click.option(
    "--log",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Append what the source is told, one JSON line each.",
)
@json_option
def command(
    coil: str | None,
    teslameter: str | None,
    voltage_source: str | None,
    thermometer: str | None,
    coil_dialect: str,
    teslameter_dialect: str,
    voltage_dialect: str,
    thermometer_dialect: str,
    baud: int | None,
    paced: bool,
    log: Path | None,
    as_json: bool,
) -> None:
    """Serve simulated serial instruments until Ctrl-C.

    One coil is behind source and teslameter. Without an option that names one, these
    two are served on pseudo-terminals. The addresses printed are ports for a bench
    file, and for any program that uses pyserial.
    """
    from sim_backend.serve import ServedBench

    if not any((coil, teslameter, voltage_source, thermometer)):
        coil = teslameter = "pty"
    with refusing():
        served = ServedBench(
            coil=coil,
            teslameter=teslameter,
            voltage_source=voltage_source,
            thermometer=thermometer,
            coil_row=coil_dialect,
            meter_row=teslameter_dialect,
            voltage_row=voltage_dialect,
            thermometer_row=thermometer_dialect,
            baud=baud,
            paced=paced,
            log=log,
        )
    served.start()
    if as_json:
        print_json(served.addresses)
    else:
        for name, address in served.addresses.items():
            say(f"{name:16}{address}")
        say("Ctrl-C ends.", sys.stderr)
    try:
        wait_for_end()
    finally:
        served.close()


def wait_for_end() -> None:
    """Return at Ctrl-C, or when the program is asked to end."""
    import signal
    import threading

    ended = threading.Event()
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda *_: ended.set())
    while not ended.wait(0.2):
        pass  # short waits, so that Windows lets Ctrl-C through
