"""``tactile-lab sequence``: several runs in turn; goes on after a fault."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactile_lab.commands.attended import INTERRUPTED, Signals
from tactile_lab.commands.one_run import (
    caught_up,
    finished,
    prepared,
    tell_of,
    tell_others,
)
from tactile_lab.commands.options import (
    live_option,
    noted,
    notes_option,
    runs_option,
    scene_asked,
    status_option,
)
from tactile_lab.commands.terminal import StatusLine, refusing, say, warn
from tactile_lab.errors import SceneError, choices, to_type

if TYPE_CHECKING:
    from tactile_lab.scene.scene import Scene

STATE = "sequence.json"
"""In the folder of the runs: what is to be done, and what was."""

LOOK_EVERY = 0.2
"""Time between two looks at clock and signals while it waits, s."""


@dataclass(frozen=True)
class SequenceRun:
    """One run of a sequence.

    Attributes:
        scene: name or path, as `run` takes it.
        changes: of single keys.
        bench: bench file or "sim"; None for the scene's own.
        status: how it ended; "running" from its beginning, "" before.
        run: its folder, once there is one.
        told: whether its report was written, and what follows a run was called.
    """

    scene: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    bench: str | None = None
    status: str = ""
    run: str = ""
    told: bool = False

    def load(self) -> Scene:
        """The scene.

        Raises:
            SceneError: it cannot be used.
        """
        return scene_asked(self.scene, self.changes, self.bench)

    def folder(self, state: Path) -> Path:
        """Of its run, beside the sequence's state, wherever that lies by now."""
        return state.parent / Path(self.run).name


@click.command()
@click.argument("scenes", nargs=-1, metavar="SCENE...|FILE")
@click.option("--bench", metavar="FILE|sim", help="Bench of all that name none.")
@runs_option
@notes_option
@click.option(
    "--at", "begin", metavar="HH:MM",
    help="Begin at that time of day, or at a date and time such as 2026-12-01T22:00.",
)  # fmt: skip
@click.option("--resume", is_flag=True, help="Go on with what was not completed.")
@click.option(
    "--go-on", is_flag=True, help="After a fault try the next; the coil verified off."
)
@click.option("--realtime", is_flag=True, help="Pace the simulated bench by the clock.")
@status_option
@live_option
@click.option("--no-report", is_flag=True, help="Leave out figures and reports.")
def command(
    scenes: tuple[str, ...],
    bench: str | None,
    out: Path,
    notes: tuple[str, ...],
    begin: str | None,
    resume: bool,
    go_on: bool,
    realtime: bool,
    status: str | None,
    live: str | None,
    no_report: bool,
) -> None:
    """Run each SCENE in turn, or those of a FILE with [[run]] tables.

    All are planned before anything is opened. What was done is kept in the folder of
    the runs. The exit code is that of the last run, or says what signal ended it.
    """
    code = 0
    with Signals() as signals, ExitStack() as served:
        with refusing():
            state = out / STATE
            known = state.exists()
            if known:
                served.enter_context(_alone(state))
            kept_notes: dict[str, str] = {}
            if resume:
                steps, kept_notes = _resumed(state, scenes, bench)
            else:
                steps = _asked(scenes, bench)
                _refuse_to_forget(state)
            _plan_all(steps)
            kept_notes |= noted(notes)
            start = None if begin is None else _time(begin)
            others = tell_others(status, live, served, signals)
            signals.look()
            if not known:
                served.enter_context(_alone(state))
            keep = partial(_keep, state, steps, kept_notes)
            keep()
        if start is not None:
            _wait(start, signals)
        for number, step in enumerate(steps):
            if signals.ending:
                code = signals.ending
                break
            if step.status == "complete":
                if not step.told:
                    if not caught_up(step.folder(state), no_report=no_report):
                        code = INTERRUPTED
                        break
                    steps[number] = replace(step, told=True)
                    keep()
                continue
            if step.status == "running":
                cut = step.folder(state)
                warn(
                    f"{cut} was not ended; `{to_type('recover', cut)}` makes whole "
                    "what it holds. It is done again."
                )
            say(f"{number + 1} of {len(steps)}: {step.scene}", sys.stderr)
            with refusing():
                execution, watchers = prepared(
                    step.load(), out, kept_notes, others, realtime=realtime
                )
            run = str(execution.folder.path)
            steps[number] = replace(step, status="running", run=run)
            keep()
            done = finished(execution, signals, watchers)
            signals.opened = False
            steps[number] = replace(step, status=str(done.state), run=run)
            keep()
            if not tell_of(done, watchers, no_report=no_report):
                code = done.exit_code or INTERRUPTED
                break
            steps[number] = replace(steps[number], told=True)
            keep()
            code = done.exit_code
            if code and not (go_on and code == 3):
                break
    _summary(steps, state)
    raise click.exceptions.Exit(code)


def _asked(scenes: tuple[str, ...], bench: str | None) -> list[SequenceRun]:
    """What the arguments name."""
    steps = [step for name in scenes for step in _named(name, bench)]
    if not steps:
        raise SceneError("Name one scene at least, or a file with [[run]] tables.")
    return steps


def _named(name: str, bench: str | None) -> Iterator[SequenceRun]:
    from tactile_lab.scene.load import read_toml

    path = Path(name)
    held = read_toml(path, "Sequence") if path.suffix == ".toml" else {}
    if "run" not in held:
        yield SequenceRun(str(path.resolve()) if path.is_file() else name, {}, bench)
        return
    known = ("scene", "set", "bench", "times")
    runs = held["run"]
    if not (isinstance(runs, list) and all(isinstance(one, dict) for one in runs)):
        raise SceneError(f"{path}: write each run as a table [[run]].")
    for number, one in enumerate(runs, 1):
        where = f"{path}: [[run]] number {number}"
        for key in (key for key in one if key not in known):
            raise SceneError(f'{where} has no key "{key}"; {choices(key, known)}')
        scene, times = one.get("scene"), one.get("times", 1)
        own, changes = one.get("bench", bench), one.get("set", {})
        if not isinstance(scene, str):
            raise SceneError(f'{where}: scene is missing; write scene = "hold_10s".')
        if not isinstance(times, int) or isinstance(times, bool) or times < 1:
            raise SceneError(f"{where}: times = {times}: a number from 1 on is needed.")
        if not isinstance(changes, dict):
            raise SceneError(f'{where}: set: write {{ "protocol.hold" = "2 s" }}.')
        beside = path.parent / scene
        file = str(beside.resolve()) if beside.is_file() else scene
        if own is not None and own != "sim":
            own = str((path.parent / str(own)).resolve())
        yield from [SequenceRun(file, changes, own)] * times


@contextmanager
def _alone(state: Path) -> Iterator[None]:
    """No other program goes on with that sequence meanwhile.

    Raises:
        SceneError: one does, or the folder cannot be written.
    """
    from tactile_lab.store.folder import lock
    from tactile_lab.whole_file import failing_as

    with ExitStack() as held:
        with failing_as(f"No sequence can be kept in {state.parent}", kind=SceneError):
            state.parent.mkdir(parents=True, exist_ok=True)
            file = held.enter_context(state.with_suffix(".lock").open("a"))
        if not lock(file):
            raise SceneError(
                f"Another program goes on with {state}. Wait for its end, or name "
                "another folder with --out."
            )
        yield


def _resumed(
    state: Path, scenes: tuple[str, ...] = (), bench: str | None = None
) -> tuple[list[SequenceRun], dict[str, str]]:
    """The sequence that was begun in that folder, and what is noted of its runs."""
    if scenes or bench:
        what = "the scenes" if scenes else "--bench"
        raise SceneError(f"--resume goes on with {state} as begun; leave {what} out.")
    try:
        held = json.loads(state.read_text(encoding="utf-8"))
        # older ones hold no notes
        return [SequenceRun(**one) for one in held["runs"]], dict(held.get("notes", {}))
    except FileNotFoundError as reason:
        raise SceneError(
            f"{state} does not exist: no sequence was begun in {state.parent}. Name "
            "its folder with --out."
        ) from reason
    except (OSError, ValueError, KeyError, TypeError) as reason:
        raise SceneError(f"{state} cannot be read: {reason}.") from reason


def _refuse_to_forget(state: Path) -> None:
    if not state.exists():
        return
    left = [s for s in _resumed(state)[0] if s.status != "complete"]
    if left:
        raise SceneError(
            f"{state} holds a sequence with {len(left)} runs to be done. Go on with "
            "--resume, or remove that file."
        )


def _plan_all(steps: list[SequenceRun]) -> None:
    """Refuse before anything is opened what any of them would be refused for."""
    from tactile_lab.planning.plan import plan
    from tactile_lab.quantity import count

    planned: dict[str, float] = {}
    whole = 0.0
    for step in steps:
        if step.status == "complete":
            continue
        key = json.dumps(asdict(step), default=str, sort_keys=True)
        if key not in planned:
            planned[key] = plan(step.load(), preview=False).estimate.duration
        whole += planned[key]
    say(f"{count(len(steps), 'run')}, {whole:.4g} s of experiment to do", sys.stderr)


def _keep(state: Path, steps: list[SequenceRun], notes: Mapping[str, str]) -> None:
    from tactile_lab.store.folder import write_json

    write_json(state, {"runs": [asdict(step) for step in steps], "notes": notes})


def _time(text: str) -> datetime:
    """When that is next."""
    now = datetime.now()
    try:
        if len(text) <= len("22:00"):
            clock = datetime.strptime(text, "%H:%M").time()
            today = datetime.combine(now.date(), clock)
            return today if today >= now else today + timedelta(days=1)
        when = datetime.fromisoformat(text)
        if when.tzinfo is not None:
            when = when.astimezone().replace(tzinfo=None)
    except ValueError as reason:
        raise SceneError(
            f"--at {text}: write HH:MM, or a date and time such as 2026-12-01T22:00."
        ) from reason
    if when < now:
        raise SceneError(f"--at {text} has passed; it is {now:%Y-%m-%dT%H:%M} now.")
    return when


def _wait(start: datetime, signals: Signals) -> None:
    """Wait until then; a signal ends it."""
    say(f"waiting until {start:%Y-%m-%d %H:%M}", sys.stderr)
    line = StatusLine(sys.stderr) if sys.stderr.isatty() else None
    while (left := (start - datetime.now()).total_seconds()) > 0:
        signals.look()
        if line is not None:
            line.show(f"{timedelta(seconds=round(left))} to wait, Ctrl-C ends")
        time.sleep(min(left, LOOK_EVERY))
    if line is not None:
        line.close()


def _summary(steps: list[SequenceRun], state: Path) -> None:
    say()
    for number, step in enumerate(steps, 1):
        say(f"{number:3}  {step.status or 'not begun':<10} {step.scene}  {step.run}")
    left = sum(step.status != "complete" for step in steps)
    if left:
        warn(
            f"{left} of {len(steps)} are not complete; "
            f"`{to_type('sequence', '--resume', '--out', state.parent)}` goes on with "
            "them."
        )
