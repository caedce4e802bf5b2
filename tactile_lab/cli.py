"""``tactile-lab``: one verb per module of `commands`, imported when it is used."""

from __future__ import annotations

import errno
import importlib
import importlib.util
import io
import os
import sys
from collections.abc import Sequence
from contextlib import suppress

import click

from tactile_lab.commands import terminal
from tactile_lab.errors import nearest

VERBS = {
    "gui": "Open the bench window.",
    "run": "Run a scene on its bench and store every sample; the demo unless given.",
    "day-one": "A first hour with a bench: computer, wiring, field, force, sensor.",
    "sequence": "Several runs, one after the other; goes on after a fault.",
    "monitor": "Watch the sensor, coil off; keep the last minute on demand.",
    "plan": "What a scene needs and leaves out, its cost and limits; opens nothing.",
    "simulate": "The model alone, no bench: spikes, error estimate, run time.",
    "study": "One scene at many points, on every core; goes on where it was.",
    "design": "Parts for a wanted threshold, rate or silence, with their yield.",
    "skin": "An array of sensors under a load: events, a film of them.",
    "validate": "The model's solver: error against run time, honesty, stability.",
    "devices": "What is attached, what answers there, which dialect row fits.",
    "doctor": "Environment, drivers, permissions, timing, disk; each with its remedy.",
    "serve-bench": "Serve the simulated serial instruments to other programs.",
    "runs": "The runs recorded so far; find, sort and tabulate by any key.",
    "note": "A note, tags or a star for a run; `runs --where` finds them.",
    "show": "What one run holds, in numbers, and where its figures are.",
    "compare": "What differs between two runs, and what each found.",
    "chart": "One number over many runs: what is usual, what drifts, by specimen.",
    "verify": "Check every sample and spike of a run; exit code 1 if damaged.",
    "recover": "Make a run whole that was cut short by a crash.",
    "export": "A run, or a skin's spikes: CSV, MATLAB, NWB, Neo, Tonic and others.",
    "report": "Page and numbers of a run from its data; several side by side.",
    "trust": "Let the code that a run from elsewhere holds be executed here.",
    "identify": "Fit parameters of the sensor to runs, with intervals.",
    "transfer": "I_S, m and swing from a measured transfer curve.",
}
"""Verb and its line in ``--help``.

Verb ``x-y`` is `command` in commands/x_y.py; those that need instruments or the
window live with them, as entry points of the group `tactile_lab.verbs`.
"""

INTERRUPTED = 130


class LazyVerbs(click.Group):
    """A group that imports a verb's module only when that verb is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All verbs, in the order of the table."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """The verb's command, None if there is no such verb."""
        if name not in VERBS:
            return None
        module = f"tactile_lab.commands.{name.replace('-', '_')}"
        command: click.Command
        if importlib.util.find_spec(module) is None:
            from tactile_lab.plugins import plugged_in

            command = plugged_in("tactile_lab.verbs", name)
        else:
            command = importlib.import_module(module).command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The verb called, or an error that names the nearest."""
        if args and args[0] not in VERBS and not args[0].startswith("-"):
            hint = nearest(args[0], VERBS).capitalize()
            raise click.UsageError(
                f'There is no verb "{args[0]}". {hint + " " if hint else ""}'
                f"Verbs: {', '.join(VERBS)}.",
                ctx,
            )
        return super().resolve_command(ctx, args)

    def format_commands(
        self, ctx: click.Context, formatter: click.HelpFormatter
    ) -> None:
        """Write the verbs from the table, so that help imports none of them."""
        with formatter.section("Verbs"):
            formatter.write_dl(list(VERBS.items()))


COMPLETION = """\b
Verbs, scenes, runs and keys complete on Tab with this line in ~/.bashrc (zsh_source
for zsh):  eval "$(_TACTILE_LAB_COMPLETE=bash_source tactile-lab)"
"""


@click.group(
    cls=LazyVerbs,
    epilog=COMPLETION,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(package_name="tactile-lab")
def cli() -> None:
    """Instrument control for spiking, adapting piezoelectric tactile sensors."""


ALGEBRA = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
"""Read as numpy is loaded: how many threads its linear algebra starts."""


def _calculate_in_one_thread() -> None:
    """Have each process calculate in one thread, unless the user asks for more.

    Two wait for each other: where other programs keep the cores busy, an inverse of
    9000 x 15 took 165 ms of processor time instead of 3.4.
    """
    for name in ALGEBRA:
        os.environ.setdefault(name, "1")


def _open_streams() -> None:
    """Give each standard stream that was closed before the start a place to go."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its code."""
    _calculate_in_one_thread()
    _open_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a pipe's encoding may lack µ or −
    try:
        with terminal.leaving_tidily():
            code = cli.main(arguments, prog_name="tactile-lab", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as asked:
        asked.show()
        code = asked.exit_code
    except click.ClickException as refused:
        message = " ".join(refused.format_message().split())
        if isinstance(refused, click.UsageError) and refused.ctx is not None:
            message += f" See `{refused.ctx.command_path} --help`."
        terminal.say(f"tactile-lab: {message}", sys.stderr)
        code = refused.exit_code
    except (click.Abort, KeyboardInterrupt):
        code = INTERRUPTED
    except BrokenPipeError:
        code = 1  # nobody reads on: no message, no traceback
    except OSError as refused:
        if refused.errno not in (errno.ENOSPC, errno.EIO):
            raise
        code = 1  # what stdout goes to takes no more
        with suppress(OSError):
            terminal.say(f"tactile-lab: cannot be printed: {refused}", sys.stderr)
    terminal.let_go()
    sys.exit(code if isinstance(code, int) else 0)
