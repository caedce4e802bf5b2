"""``tactile-lab verify``: is a run as it was written?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import print_json, progress, refusing, say

if TYPE_CHECKING:
    from tactile_lab.store.verify import Verification

DAMAGED = 1


@click.command()
@run_argument
@json_option
def command(run: Path, as_json: bool) -> None:
    """Check every chunk, checksum, counter and spike of RUN; change nothing.

    Exit codes: 0 sound, 1 damage was found (and where), 2 not a folder.
    """
    with refusing():
        from tactile_lab.errors import RunFolderError
        from tactile_lab.store.verify import verify

        if not run.is_dir():
            raise RunFolderError(f"{run} is no folder; give the folder of one run.")
        with progress("checking every sample") as update:
            verdict = verify(run, update)
    proof = verdict.certificate
    if as_json:
        print_json(
            {
                "run": str(run),
                "sound": verdict.sound,
                "findings": [
                    {"where": finding.where, "what": finding.what}
                    for finding in verdict.findings
                ],
                "notes": list(verdict.notes),
                "loss": proof.to_json() if proof else None,
            }
        )
    else:
        for finding in verdict.findings:
            say(f"damage      {finding}")
        for note in verdict.notes:
            say(f"note        {note}")
        if proof is not None:
            say(str(proof))
        say(_result(verdict))
    if not verdict.sound:
        raise click.exceptions.Exit(DAMAGED)


def _result(verdict: Verification) -> str:
    """The last line: what it comes to."""
    if not verdict.sound:
        return f"{len(verdict.findings)} findings"
    proof = verdict.certificate
    if proof is not None and proof.missing:
        return "as it was written, but samples are missing"
    if proof is not None and proof.surplus:
        return "as it was written, but samples are too many"
    if proof is not None and proof.samples:
        return "as it was written, but samples are lost"
    return "sound"
