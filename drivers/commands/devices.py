"""``tactile-lab devices``: what is attached, what it answers, which row fits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tactile_lab.commands.options import json_option
from tactile_lab.commands.terminal import fail, print_json, refusing, say
from tactile_lab.errors import TactileLabError

FAULTED = 3
UNITS = ("_V", "_A", "_T", "_K", "_s", "_part")
"""End the names of settings that are numbers; an instrument's own codes are texts."""


@click.command()
@click.option(
    "--port",
    "ports",
    multiple=True,
    metavar="PORT",
    help="Ask there instead of looking for ports; any address pyserial takes.",
)
@click.option("--no-ask", is_flag=True, help="List only; send nothing to anything.")
@click.option(
    "--dialect",
    metavar="ROW",
    help="With one --port: open it as a run would, read back, make safe, close.",
)
@click.option("--baud", type=click.IntRange(50, 4_000_000), help="With --dialect.")
@click.option(
    "--transcript",
    type=click.Path(path_type=Path, dir_okay=False),
    help="With --dialect: write every byte there.",
)
@json_option
def command(
    ports: tuple[str, ...],
    no_ask: bool,
    dialect: str | None,
    baud: int | None,
    transcript: Path | None,
    as_json: bool,
) -> None:
    """List serial ports, scopes and what answers there.

    USB serial adapters are asked for the instrument's name with the harmless *IDN?.
    No output is switched on, and nothing set but by --dialect.
    """
    from drivers.attached import attached

    if dialect is not None:
        if len(ports) != 1:
            fail("--dialect needs exactly one --port.", 2)
        if no_ask:
            fail("--dialect asks the instrument; leave out --no-ask.", 2)
        _try_out(ports[0], dialect, baud, transcript, as_json)
        return
    if transcript is not None or baud is not None:
        fail("--transcript and --baud need --dialect and --port.", 2)
    with refusing():
        found = attached(ask=not no_ask, ports=ports)
    if as_json:
        print_json({"devices": found})
        return
    if not found:
        say("Nothing is attached.")
    for one in found:
        _print(one)


def _print(one: dict[str, Any]) -> None:
    say(f"{one['address']}  {one['title']}")
    if one["stays"]:
        say(f"    stays     {one['stays']}")
    if one["identity"]:
        say(f"    answers   {one['identity']}")
    if one["fits"]:
        say(f"    fits      {', '.join(one['fits'])}")
    if one["problem"]:
        say(f"    problem   {one['problem']}")


def _try_out(
    port: str, dialect: str, baud: int | None, transcript: Path | None, as_json: bool
) -> None:
    from drivers.attached import try_out
    from tactile_lab.errors import SceneError

    try:
        settings = try_out(port, dialect, baud=baud, transcript=transcript)
    except SceneError as reason:
        fail(str(reason), 2)
    except TactileLabError as reason:
        fail(str(reason), FAULTED)
    else:
        if as_json:
            print_json({name: _plain(name, text) for name, text in settings.items()})
        else:
            for name, value in settings.items():
                say(f"{name:20}{value}")


def _plain(name: str, text: str) -> str | float | bool | list[str]:
    """What was read back, as JSON has it."""
    if name == "baud":
        return int(text)
    if name == "output":
        return text == "on"
    if name == "not_tried":
        return text.split(", ") if text else []
    return float(text) if name.endswith(UNITS) else text
