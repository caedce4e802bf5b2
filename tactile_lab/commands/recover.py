"""``tactile-lab recover``: make a run whole that was cut short."""

from __future__ import annotations

from pathlib import Path

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import print_json, progress, reading, say


@click.command()
@run_argument
@json_option
def command(run: Path, as_json: bool) -> None:
    """Recover RUN after a crash: readable by any program, status and spikes restored.

    Works on a copy; the file as the crash left it stays as data.killed.h5.
    """
    with reading(run):
        from tactile_lab.quantity import count
        from tactile_lab.store.recover import recover

        with progress("recovering") as update:
            done = recover(run, update)
    if as_json:
        print_json(
            {
                "run": str(run),
                "samples": done.samples,
                "dropped": done.dropped,
                "spikes": done.spikes,
                "original": None if done.original is None else str(done.original),
            }
        )
        return
    say(
        f"{run}: {done.samples} samples per channel and {count(done.spikes, 'spike')} "
        f"recovered, {done.dropped} samples dropped because not all channels had them"
    )
    if done.original is not None:
        say(f"the file as it was: {done.original} (delete it when content)")
