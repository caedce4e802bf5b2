"""``tactile-lab design``: parts for a wanted behaviour."""

from __future__ import annotations

from pathlib import Path

import click

from tactile_lab.commands.options import json_option
from tactile_lab.commands.terminal import print_json, refusing, say, working


@click.command()
@click.argument("specification", type=click.Path(path_type=Path))
@json_option
def command(specification: Path, as_json: bool) -> None:
    """Choose parts for what SPECIFICATION, a TOML file, wants of the sensor.

    Values are those of a series; each want is checked by the full solver. Exits 1 where
    something that is wanted cannot be had.
    """
    with refusing():
        from tactile_lab.studies.parts import choose
        from tactile_lab.studies.specification import load_specification

        asked = load_specification(specification)
        with working("choosing parts"):
            chosen = choose(asked)
    if as_json:
        print_json(chosen.conclusion.plain)
    else:
        say(chosen.conclusion.text)
    if not chosen.met:
        raise SystemExit(1)
