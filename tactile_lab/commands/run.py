"""``tactile-lab run``: execute a scene on its bench, the main job."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.attended import Signals
from tactile_lab.commands.one_run import (
    answer,
    concluded,
    finished,
    prepared,
    print_run,
    tell_others,
)
from tactile_lab.commands.options import (
    json_option,
    live_option,
    noted,
    notes_option,
    runs_option,
    scene_asked,
    scene_options,
    status_option,
)
from tactile_lab.commands.terminal import print_json, refusing, say, warn

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed
    from tactile_lab.bench import Bench
    from tactile_lab.report.write import Report
    from tactile_lab.scene.scene import Scene
    from tactile_lab.store.compare import Differences


@click.command()
@scene_options
@click.option("--realtime", is_flag=True, help="Pace the simulated bench by the clock.")
@runs_option
@notes_option
@click.option(
    "--transcript",
    "transcripts",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write every byte to and from the serial instruments into files there.",
)
@click.option(
    "--again",
    type=click.Path(path_type=Path),
    metavar="RUN",
    help="Repeat the run in folder RUN and say what differs.",
)
@click.option(
    "--field",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="What a manual teslameter showed at each hold, one a line, mT or with unit.",
)
@status_option
@live_option
@click.option("--no-report", is_flag=True, help="Leave out figure and report.")
@json_option
def command(
    scene: str | None,
    overrides: tuple[str, ...],
    bench: str | None,
    realtime: bool,
    out: Path,
    notes: tuple[str, ...],
    transcripts: Path | None,
    again: Path | None,
    field: Path | None,
    status: str | None,
    live: str | None,
    no_report: bool,
    as_json: bool,
) -> None:
    """Run SCENE (or PROTOCOL.py; the demo unless given) and store every sample.

    Exit codes: 0 complete, 1 complete but its answer could not be printed, 2 refused
    before anything was opened, 3 faulted with the coil verified off, 4 the coil's state
    could not be verified, 129, 130 or 143 interrupted by SIGHUP, SIGINT or SIGTERM with
    the coil verified off.
    """
    began = time.monotonic()
    with Signals() as signals, ExitStack() as served:
        with refusing():
            loaded = _scene(scene, overrides, bench, again)
            signals.look()
            if transcripts is not None:
                make_folder(transcripts)
            execution, watchers = prepared(
                loaded,
                out,
                noted(notes),
                tell_others(status, live, served, signals),
                realtime=realtime,
                field=field,
            )
            if transcripts is not None:
                record(execution.bench, transcripts)
            for text in execution.plan.warnings:
                warn(text)
        done = finished(execution, signals, watchers)

        unread: list[OSError] = []

        def tell(done: Executed, report: Report | None) -> None:
            changed = None if again is None else _differences(again, done)
            watchers.end(answer(done, report, changed))
            try:
                if as_json:
                    print_json(answer(done, report, changed))
                    return
                print_run(done, report, time.monotonic() - began)
                if changed is not None:
                    say(f"against {again}\n{changed}")
            except OSError as full:
                # who read a pipe that broke has gone, and wanted no more
                if not isinstance(full, BrokenPipeError):
                    unread.append(full)
                raise

        concluded(done, no_report=no_report, tell=tell)
    raise click.exceptions.Exit(done.exit_code or (1 if unread else 0))


def make_folder(folder: Path) -> None:
    """Make the folder for transcripts, before there is one of a run.

    Raises:
        SceneError: it cannot be written.
    """
    from tactile_lab.errors import SceneError
    from tactile_lab.whole_file import failing_as

    with failing_as(f"Transcripts cannot be put into {folder}", kind=SceneError):
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder):
            pass


def record(bench: Bench, folder: Path) -> None:
    """Have each serial instrument of `bench` write a transcript into `folder`.

    Raises:
        SceneError: the files cannot be written.
    """
    names = ("coil", "field_meter", "thermometer")
    found = {name: getattr(bench, name) for name in names}
    found |= dict(bench.voltage_sources)
    for name, instrument in found.items():
        start = getattr(instrument, "record", None)
        if start is not None:
            start(folder / f"{name}.txt")


def _scene(
    path: str | None, overrides: tuple[str, ...], bench: str | None, again: Path | None
) -> Scene:
    """The scene asked for, or the resolved one of the run to repeat."""
    from tactile_lab.errors import SceneError
    from tactile_lab.scene.load import load

    if again is None:
        return scene_asked(path, overrides, bench)
    if path is not None:
        raise SceneError(f"--again {again} repeats that run; leave {path} out.")
    from tactile_lab.store.folder import read_info

    name = str(read_info(again).get("scene", again.name))
    return replace(load(again / "scene.toml", overrides, bench), name=name)


def _differences(again: Path, done: Executed) -> Differences | None:
    from tactile_lab.errors import TactileLabError
    from tactile_lab.store.compare import differences

    try:
        return differences(again, done.folder)
    except TactileLabError as error:
        warn(f"the runs cannot be compared: {error}")
        return None
