"""``tactile-lab run``: execute a scene on its bench, the main job."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactile_lab.commands.attended import Signals, interrupted, run_attended
from tactile_lab.commands.options import (
    json_option,
    noted,
    notes_option,
    runs_option,
    scene_options,
)
from tactile_lab.commands.read_off import field_reader
from tactile_lab.commands.terminal import (
    ProgressLine,
    fail,
    print_json,
    progress,
    refusing,
    say,
    somebody,
    warn,
)

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed
    from tactile_lab.acquisition.events import Event
    from tactile_lab.acquisition.model_comparison import ModelComparison
    from tactile_lab.bench import Bench
    from tactile_lab.engine.execution import Execution
    from tactile_lab.report.write import Report
    from tactile_lab.scene.scene import Scene
    from tactile_lab.store.compare import Differences


@click.command()
@scene_options
@click.option("--realtime", is_flag=True, help="Pace the simulated bench by the clock.")
@runs_option
@notes_option
@click.option(
    "--temperature",
    metavar="VALUE",
    help='Of the room, kept with the run, such as "23.5 °C"; see [conditions].',
)
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
@click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    metavar="KEY=FROM:TO:STEP",
    help="Run it at each value, as a study: --sweep 'protocol.hold=1 s:3 s:1 s'.",
)
@click.option(
    "--repeat",
    type=click.IntRange(min=1),
    default=1,
    metavar="N",
    help="Run it N times at each value, as a study.",
)
@click.option("--no-report", is_flag=True, help="Leave out figure and report.")
@json_option
def command(
    scene: str | None,
    overrides: tuple[str, ...],
    bench: str | None,
    realtime: bool,
    out: Path,
    notes: tuple[str, ...],
    temperature: str | None,
    transcripts: Path | None,
    again: Path | None,
    field: Path | None,
    sweeps: tuple[str, ...],
    repeat: int,
    no_report: bool,
    as_json: bool,
) -> None:
    """Run SCENE (or PROTOCOL.py; the demo unless given) and store every sample.

    Exit codes: 0 complete, 2 refused before anything was opened, 3 faulted with the
    coil verified off, 4 the coil's state could not be verified, 129, 130 or 143
    interrupted by SIGHUP, SIGINT or SIGTERM with the coil verified off.
    """
    began = time.monotonic()
    with Signals() as signals:
        with refusing():
            from tactile_lab.engine.execution import Execution

            if temperature is not None:
                overrides = (*overrides, f"conditions.temperature={temperature}")
            loaded = _scene(scene, overrides, bench, again)
            if sweeps or repeat > 1:
                given = {
                    "--realtime": realtime,
                    "--note": notes,
                    "--transcript": transcripts,
                    "--again": again,
                    "--field": field,
                }
                _refuse_with_sweep([name for name, value in given.items() if value])
                with interrupted():
                    _sweep(loaded, sweeps, repeat, out, as_json=as_json)
                return
            signals.look()
            narrator, person = Narrator(loaded.name), somebody()
            execution = Execution(
                loaded,
                out,
                realtime=realtime,
                emit=narrator,
                notes=noted(notes),
                ask=person,
                asked_field=field_reader(loaded, person, field),
            )
            if transcripts is not None:
                record(execution.bench, transcripts)
            for text in execution.plan.warnings:
                warn(text)
        narrator.expect(execution)
        done = finished(execution, signals, narrator)
        with interrupted():
            try:
                for text in _overrange(done):
                    warn(text)
                if done.exit_code:
                    say(f"tactile-lab: {done.told}", sys.stderr)
                report = None if no_report else _report(done)
                changed = None if again is None else _differences(again, done)
                if as_json:
                    print_json(answer(done, report, changed))
                else:
                    _print(done, report, time.monotonic() - began)
                    if changed is not None:
                        say(f"against {again}\n{changed}")
            except (Exception, KeyboardInterrupt) as failure:
                _unreported(done, failure)
    # how the run ended, whatever became of telling it
    if not done.off.verified:
        fail(done.off.text, done.exit_code)
    raise click.exceptions.Exit(done.exit_code)


def finished(execution: Execution, signals: Signals, narrator: Narrator) -> Executed:
    """How an execution ended, which is carried out here.

    Raises:
        click.exceptions.Exit: it could not be begun; told.
    """
    try:
        done = run_attended(execution, signals)
    except Exception as error:
        with suppress(OSError):
            narrator.close()
        fail(str(error), 3 if execution.coil_left_safe else 4)
    with suppress(OSError):
        narrator.close()
    return done


def _refuse_with_sweep(options: list[str]) -> None:
    from tactile_lab.errors import SceneError

    if options:
        raise SceneError(
            f"{' and '.join(options)} cannot go with --sweep or --repeat: that is a "
            "study (`tactile-lab study --help`). Leave it out, or run once."
        )


def _sweep(
    scene: Scene, sweeps: tuple[str, ...], repeat: int, out: Path, *, as_json: bool
) -> None:
    """Run `scene` at each value, `repeat` times, with its runs kept below `out`."""
    from tactile_lab.commands.study import carry_out_attended
    from tactile_lab.studies.study import short

    carry_out_attended(short(scene, sweeps, repeat), out, as_json=as_json)


def record(bench: Bench, folder: Path) -> None:
    """Have each serial instrument of `bench` write a transcript into `folder`.

    Raises:
        SceneError: the files cannot be written.
    """
    from tactile_lab.errors import SceneError

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        raise SceneError(
            f"Transcripts cannot be put into {folder}: {reason}"
        ) from reason
    for name in ("coil", "field_meter"):
        start = getattr(getattr(bench, name), "record", None)
        if start is not None:
            start(folder / f"{name}.txt")


class Narrator:
    """Tells on stderr how the run goes."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._progress: ProgressLine | None = None
        self._trial = ""
        self._spikes = 0
        self._rate = 0.0
        self._model: ModelComparison | None = None

    def expect(self, execution: Execution) -> None:
        """This is about to run; the model will run beside it."""
        self._progress = ProgressLine(execution.plan.estimate.duration, self._label)
        searched = execution.needs.detect_on is not None
        stored = "V_C1" in execution.needs.stored
        if execution.scene.compared and (searched or stored):
            from tactile_lab.acquisition.model_comparison import ModelComparison

            self._model = ModelComparison(execution.scene, searched=searched)

    def __call__(self, event: Event) -> None:
        """Take an event of the run."""
        from tactile_lab.acquisition import events

        progress = self._progress
        if progress is None:
            return
        match event:
            case events.CoilCurrent():
                if self._model is not None:
                    self._model.add(event)
            case events.TrialEnded(outcome=outcome):
                told = "" if self._model is None else self._model.ended(outcome)
                if told:
                    progress.note(told)
            case events.TrialStarted(trial=trial):
                self._trial = trial.label
            case events.SpikesSeen(times=times, rates=rates):
                self._spikes += len(times)
                self._rate = rates[-1]
            case events.Progress(elapsed=elapsed):
                progress.update(elapsed, self._now())
            case events.Message(level=level, text=text):
                progress.note(f"{level}: {text}")
            case events.StateChanged(state=events.RunState.STOPPING, text=text):
                progress.note(text)

    def _now(self) -> str:
        """The trial, and the spikes so far with the last interval's rate."""
        if not self._spikes:
            return self._trial
        told = f"{self._spikes} spikes, last at {self._rate:.3g} Hz"
        return f"{self._trial}  {told}".strip()

    def close(self) -> None:
        """Leave the terminal ready for other output."""
        if self._progress is not None:
            self._progress.close()


def answer(
    done: Executed, report: Report | None, changed: Differences | None = None
) -> dict[str, Any]:
    """The documented object (docs/json.md)."""
    return {
        "run": str(done.folder),
        "status": str(done.state),
        "spikes": done.spikes,
        "loss": dict(done.loss),
        "duration_s": done.duration,
        "run_time_s": done.took,
        "reason": done.reason,
        "coil": done.off.text,
        "coil_verified_off": done.off.verified,
        "report": None if report is None else str(report.html),
        "differences": None if changed is None else asdict(changed),
    }


def _scene(
    path: str | None, overrides: tuple[str, ...], bench: str | None, again: Path | None
) -> Scene:
    """The scene asked for, or the resolved one of the run to repeat."""
    from tactile_lab.errors import SceneError
    from tactile_lab.scene.load import load

    if again is None:
        return load(path, overrides, bench)
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


def _report(done: Executed) -> Report | None:
    from tactile_lab.errors import TactileLabError
    from tactile_lab.report.from_run import read
    from tactile_lab.report.write import write

    try:
        with progress("writing the report") as update:
            report = write(done.folder, read(done.folder), progress=update)
    except (TactileLabError, OSError) as error:
        warn(f"the report could not be written: {error}")
        return None
    for text in report.findings.missing:
        warn(text)
    return report


def _print(done: Executed, report: Report | None, took: float) -> None:
    from tactile_lab.report.table import trials_table

    if report is not None:
        run = report.findings.run
        say(trials_table(run).text)
        say()
        if text := report.findings.conclusion.text:
            say(f"{text}\n")
        say(
            f"{run.duration:.1f} s of experiment in {took:.1f} s "
            f"({done.took:.1f} s of it running)."
        )
        beside = report.findings.beside
        if beside is not None:
            say(beside.budget_line)
            if beside.explanation is not None:
                say(f"The model misses by more. {beside.explanation.text}")
        if run.accuracy:
            say(run.accuracy)
        if run.loss is not None:
            say(run.loss.sentence)
        say(f"figure  {report.png}")
        say(f"report  {report.html}")
    say(f"run     {done.folder}")


def _overrange(done: Executed) -> tuple[str, ...]:
    """Which inputs left their range, and when."""
    from tactile_lab.store.folder import read_info

    if not read_info(done.folder).get("overrange"):
        return ()
    from tactile_lab.store.overrange import told
    from tactile_lab.store.run import Run

    with Run.load(done.folder) as run:
        return told(run)


def _unreported(done: Executed, failure: BaseException) -> None:
    """Say that the run could not be told of to the end, if that can be said."""
    text = f"{type(failure).__name__}: {failure}".removesuffix(": ")
    warn(
        f"the report was cut short ({text}). The run is kept in {done.folder}; "
        f"`tactile-lab report {done.folder}` writes it again."
    )
