"""One run at a terminal: how it goes, how it ended, its report, and what follows it."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from tactile_lab.commands.attended import Signals, interrupted, run_attended
from tactile_lab.commands.read_off import field_reader
from tactile_lab.commands.terminal import (
    ProgressLine,
    fail,
    progress,
    say,
    somebody,
    warn,
    working,
)
from tactile_lab.errors import to_type

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from contextlib import ExitStack
    from pathlib import Path

    from tactile_lab.acquisition.ending import Executed
    from tactile_lab.acquisition.events import Event
    from tactile_lab.acquisition.model_comparison import ModelComparison
    from tactile_lab.commands.status_server import StatusServer
    from tactile_lab.engine.execution import Execution
    from tactile_lab.engine.lsl import LslStreams
    from tactile_lab.report.write import Report
    from tactile_lab.scene.scene import Scene
    from tactile_lab.store.compare import Differences


class Narrator:
    """Tells on stderr how the run goes."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._progress: ProgressLine | None = None
        self._trial = ""
        self._spikes = 0
        self._rate = 0.0
        self._counted = True
        self._model: ModelComparison | None = None

    def expect(self, execution: Execution) -> None:
        """This is about to run; the model will run beside it."""
        self._progress = ProgressLine(execution.plan.estimate.duration, self._label)
        self._counted = execution.counted
        searched = execution.needs.detect_on is not None
        stored = "V_C1" in execution.needs.stored
        if execution.scene.compared and (searched or stored):
            from tactile_lab.acquisition.model_comparison import ModelComparison

            self._model = ModelComparison(
                execution.scene, searched=searched, counted=self._counted
            )

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
        """The trial, the spikes so far and, where none is missed, the last rate."""
        if not self._spikes:
            return self._trial
        last = f", last at {self._rate:.3g} Hz" if self._counted else " seen, not all"
        told = f"{self._spikes} spikes{last}"
        return f"{self._trial}  {told}".strip()

    def close(self) -> None:
        """Leave the terminal ready for other output."""
        if self._progress is not None:
            self._progress.close()


class Watchers:
    """Who is told of a run: the terminal, and other programs where they asked.

    Args:
        narrator: tells it at the terminal.
        others: tell it to other programs.
    """

    def __init__(
        self, narrator: Narrator, others: tuple[StatusServer | LslStreams, ...] = ()
    ) -> None:
        self.narrator, self.others = narrator, others

    def expect(self, execution: Execution) -> None:
        """This is about to run."""
        self.narrator.expect(execution)
        for other in self.others:
            other.begin(execution)

    def end(self, result: dict[str, Any]) -> None:
        """Tell what came of it, as ``--json`` prints it."""
        for other in self.others:
            other.end(result)


def tell_others(
    status: str | None, live: str | None, until: ExitStack, signals: Signals
) -> tuple[StatusServer | LslStreams, ...]:
    """Who tells other programs of runs until that stack is left; nobody unless asked.

    Raises:
        SceneError: that is no address or cannot be listened at, or LSL is not there.
    """
    others: list[StatusServer | LslStreams] = []
    if status is not None:
        from tactile_lab.commands.status_server import StatusServer

        server = StatusServer(status, signals.ask)
        until.callback(server.close)
        others.append(server)
        say(f"status {server.address}", sys.stderr)
        if not server.local:
            reach = f"every computer that reaches {server.address}"
            warn(f"{reach} can read it and stop runs.")
    if live is not None:
        from tactile_lab.engine.lsl import LslStreams

        streams = LslStreams(warn)
        until.callback(streams.close)
        others.append(streams)
        say(f"live   lsl {streams.source}", sys.stderr)
    return tuple(others)


def prepared(
    scene: Scene,
    out: Path,
    notes: Mapping[str, str],
    others: tuple[StatusServer | LslStreams, ...] = (),
    *,
    realtime: bool = False,
    field: Path | None = None,
) -> tuple[Execution, Watchers]:
    """A run about to begin, and who is told of it; its folder is there.

    Args:
        scene: what to run.
        out: folder for run folders.
        notes: kept with it.
        others: tell other programs of it.
        realtime: pace a simulated bench by the clock.
        field: file of what a manual teslameter showed.

    Raises:
        TactileLabError: it is refused.
    """
    from tactile_lab.engine.execution import Execution

    watchers, person = Watchers(Narrator(scene.name), others), somebody()
    execution = Execution(
        scene,
        out,
        realtime=realtime,
        emit=watchers.narrator,
        others=others,
        notes=notes,
        ask=person,
        asked_field=field_reader(scene, person, field),
    )
    return execution, watchers


def finished(execution: Execution, signals: Signals, watchers: Watchers) -> Executed:
    """How an execution ended, which is carried out here.

    Raises:
        click.exceptions.Exit: it could not be begun; told.
    """
    watchers.expect(execution)
    try:
        done = run_attended(execution, signals)
    except Exception as error:
        with suppress(OSError):
            watchers.narrator.close()
        fail(str(error), 3 if execution.coil_left_safe else 4)
    with suppress(OSError):
        watchers.narrator.close()
    return done


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


def write_report(folder: Path) -> Report | None:
    """Write the report of a run; None where it cannot be, which is told."""
    from tactile_lab.errors import TactileLabError
    from tactile_lab.report.from_run import read
    from tactile_lab.report.write import write

    try:
        with progress("writing the report") as update:
            report = write(folder, read(folder), progress=update)
    except (TactileLabError, OSError) as error:
        warn(f"the report could not be written: {error}")
        return None
    for text in report.findings.missing:
        warn(text)
    return report


def print_run(done: Executed, report: Report | None, took: float) -> None:
    """Print what a run gave, and where it lies; `took` it s of wall time in all."""
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
        for line in report.findings.budget_lines:
            say(line)
        beside = report.findings.beside
        if beside is not None and beside.explanation is not None:
            say(f"The model misses by more. {beside.explanation.text}")
        if run.accuracy:
            say(run.accuracy)
        if run.loss is not None:
            say(run.loss.sentence)
        say(f"figure  {report.png}")
        say(f"report  {report.html}")
    say(f"run     {done.folder}")


def overrange(done: Executed) -> tuple[str, ...]:
    """Which inputs left their range, and when."""
    from tactile_lab.store.folder import read_info

    if not read_info(done.folder).get("overrange"):
        return ()
    from tactile_lab.store.overrange import told
    from tactile_lab.store.run import Run

    with Run.load(done.folder) as run:
        return told(run)


def concluded(
    done: Executed, *, no_report: bool, tell: Callable[[Executed, Report | None], None]
) -> bool:
    """Tell of a run that ended, write its report, and do what follows a run.

    How it ended, and how the coil was left, is told first, and once. Nothing in here
    changes it: what fails is told, and what comes after is done all the same. False
    where a signal cut this short: then whoever has more to do ends, too.

    Args:
        done: how it ended.
        no_report: leave the report out.
        tell: says more of it, with its report where there is one.
    """
    if done.exit_code:
        with suppress(OSError):  # nobody may be there to read it
            say(f"tactile-lab: {done.told}", sys.stderr)
    report: Report | None = None
    with interrupted():
        whole = Whole(done.folder)
        with whole.though("the report"):
            for text in overrange(done):
                warn(text)
            if not no_report:
                report = write_report(done.folder)
        with whole.though("what it says of the run"):
            tell(done, report)
        if not whole.ended:
            with whole.though("after_run"):
                _follow(done.folder)
    return not whole.ended


def caught_up(folder: Path, *, no_report: bool) -> bool:
    """Do for a run that is complete what the program was killed before doing.

    Nothing that fails in here is more than told; False where a signal cut it short.
    """
    from tactile_lab.store.folder import REPORT

    with interrupted():
        whole = Whole(folder)
        with whole.though("the report"):
            if not no_report and not (folder / REPORT).exists():
                write_report(folder)
        if not whole.ended:
            with whole.though("after_run"):
                _follow(folder)
    return not whole.ended


class Whole:
    """A run that stays what it was, though what comes after it fails.

    Args:
        folder: the run's.

    Attributes:
        ended: whether a signal cut short what came after it.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.ended = False

    @contextmanager
    def though(self, what: str) -> Iterator[None]:
        """Say that `what` was cut short where it fails within."""
        try:
            yield
        except (Exception, KeyboardInterrupt) as failure:
            self.ended = self.ended or isinstance(failure, KeyboardInterrupt)
            text = f"{type(failure).__name__}: {failure}".removesuffix(": ")
            warn(
                f"{what} was cut short ({text}). The run is kept in {self._folder}; "
                f"`{to_type('report', self._folder)}` writes its report again."
            )


def _follow(folder: Path) -> None:
    """Call what the lab has follow each run; what goes wrong with it is told."""
    from tactile_lab.lab import lab

    said = lab()
    told = [f"after_run: {program}" for program in said.after_run[:1]]
    with working(told[0]) if told else nullcontext():
        problem = said.follow(folder)
    if problem:
        warn(problem)


def tell_of(done: Executed, watchers: Watchers, *, no_report: bool) -> bool:
    """Tell of a run that ended, as text and to other programs; see `concluded`."""
    began = time.monotonic() - done.took

    def tell(done: Executed, report: Report | None) -> None:
        watchers.end(answer(done, report))
        print_run(done, report, time.monotonic() - began)

    return concluded(done, no_report=no_report, tell=tell)
