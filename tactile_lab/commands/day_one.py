"""``tactile-lab day-one``: a lab's first hour with its bench, step by step."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from datetime import datetime
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactile_lab.commands.attended import INTERRUPTED, Signals
from tactile_lab.commands.day_steps import STEPS, FirstDayStep, levels
from tactile_lab.commands.one_run import finished, prepared, tell_of
from tactile_lab.commands.options import noted, notes_option
from tactile_lab.commands.terminal import fail, refusing, say, somebody, warn
from tactile_lab.errors import to_type

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed

STATE, BENCH, PAGE = "day-one.json", "bench.toml", "day-one.html"


@click.command("day-one")
@click.option("--bench", metavar="FILE|sim", help="Your bench file; asked for first.")
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
    default=Path("day-one"), show_default=True, help="Where all of it is put.",
)  # fmt: skip
@click.option(
    "--set", "overrides", multiple=True, metavar="STEP:KEY=VALUE",
    help='Change a key of one step, such as "threshold_search:protocol.most=80 mN".',
)  # fmt: skip
@click.option(
    "--redo", "again", metavar="STEP", help="Do that step, and later ones, anew."
)
@notes_option
def command(
    bench: str | None,
    out: Path,
    overrides: tuple[str, ...],
    again: str | None,
    notes: tuple[str, ...],
) -> None:
    """Lead through a lab's first hour: computer, wiring, field, force, sensor.

    Each step says what it does, what to see, and what to do if it is not seen; a step
    that was done is not repeated, so the same command goes on after a mend. Ends with a
    bench file that carries your calibration, and a page for the notebook.
    """
    with refusing():
        day = Day.begun(out, bench, again)
        changes = _changes(overrides)
        kept_notes = noted(notes)
        person = None if day.simulated else somebody()
    with Signals() as signals:
        for number, step in enumerate(STEPS, 1):
            if step.name in day.done:
                say(f"{number} of {len(STEPS)}  {step.title}  done before")
                continue
            say(f"\n{number} of {len(STEPS)}  {step.title}")
            signals.look()
            if step.wrong is None:
                words = [step.name, *day.words(step)]
                say(f"  $ tactile-lab {' '.join(words)}")
                printed, wrong = _verb(words)
                day.did(step, printed, wrong)
            else:
                if step.before and not day.simulated:
                    _ask(person, step.before)
                changed = changes.get(step.name, ())
                words = ["run", step.name, "--bench", day.bench]
                words += ["--out", str(out / "runs")]
                words += [word for change in changed for word in ("--set", change)]
                say(f"  $ tactile-lab {shlex.join(words)}")
                with refusing():
                    scene = day.load(step, changed)
                    run = prepared(scene, out / "runs", kept_notes)
                done = finished(run[0], signals, run[1])
                signals.opened = False
                if not tell_of(done, run[1], no_report=False):
                    fail("stopped while it told of the run", INTERRUPTED)
                wrong = day.ran(step, done, changed)
            say(f"  to see: {step.see}")
            if wrong:
                say(f"  WRONG: {wrong}\n  what to do: {step.otherwise}")
                if step.wrong is not None:
                    again_command = to_type("day-one", "--out", out)
                    fail(f"mend that, then go on with {again_command}", day.code or 1)
    with refusing():
        page = day.page(kept_notes)
    say(f"\nbench   {day.bench}\npage    {page}")


class Day:
    """What was done so far, kept in a folder.

    Attributes:
        out: the folder.
        bench: bench file that the next step uses, or "sim".
        done: steps that went well, with their run and what it said.
        code: exit code of the last run that did not complete; 0 for none.
    """

    def __init__(self, out: Path, bench: str, done: dict[str, Any]) -> None:
        self.out, self.bench, self.done, self.code = out, bench, done, 0

    @classmethod
    def begun(cls, out: Path, bench: str | None, again: str | None) -> Day:
        """Go on in that folder, or begin.

        Raises:
            SceneError: no bench is named, or another one than before.
        """
        from tactile_lab.errors import SceneError, choices
        from tactile_lab.lab import lab

        state = out / STATE
        names = [step.name for step in STEPS]
        if again is not None and again not in names:
            raise SceneError(f"--redo {again}: {choices(again, names, 'Steps')}")
        if not state.exists():
            chosen = bench or (lab().bench if "bench" in lab().origin else None)
            if chosen is None:
                raise SceneError(
                    "Name your bench file with --bench FILE, or try it all out with "
                    "--bench sim. docs/scenes.md says what a bench file holds."
                )
            return cls(out, _absolute(chosen), {})
        try:
            held = json.loads(state.read_text(encoding="utf-8"))
            kept, done = held["bench"], dict(held["done"])
        except (OSError, ValueError, KeyError, TypeError) as reason:
            raise SceneError(f"{state} cannot be read: {reason}.") from reason
        for name in names[names.index(again) :] if again else ():
            done.pop(name, None)
        if bench is not None and "calibrate_field" not in done:
            kept = _absolute(bench)
        return cls(out, kept, done)

    @property
    def simulated(self) -> bool:
        """Whether no instrument is there."""
        from tactile_lab.scene.load import load_bench

        return load_bench(self.bench).simulated

    def load(self, step: FirstDayStep, changes: tuple[str, ...]) -> Any:
        """The scene of a step on the bench as it is known now.

        Raises:
            SceneError: it cannot be used.
        """
        from tactile_lab.scene.load import load

        return load(step.name, changes, self.bench)

    def words(self, step: FirstDayStep) -> tuple[str, ...]:
        """What a verb is told beside its name."""
        return ("--bench", self.bench) if step.name == "doctor" else ()

    def did(self, step: FirstDayStep, printed: str, wrong: str) -> None:
        """A verb was called; what it printed is for a person to judge."""
        said = [wrong] if wrong else []
        self.done[step.name] = {"at": _now(), "said": said, "printed": printed}
        self._keep()

    def ran(self, step: FirstDayStep, done: Executed, changed: tuple[str, ...]) -> str:
        """A scene was run, so changed: what is wrong with it, "" if nothing."""
        self.code = done.exit_code
        if done.exit_code:
            return done.told
        try:
            file = done.folder / "results.json"
            results = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as reason:
            return f"the run's results cannot be read ({reason})"
        wrong = step.wrong(results) if step.wrong is not None else ""
        if wrong:
            return wrong
        if step.name == "calibrate_field":
            self._calibrate(done.folder)
        self.done[step.name] = {
            "at": _now(),
            "run": os.path.relpath(done.folder, self.out),
            "changes": changed,
            "said": [*results["statements"], *results["missing"]] or levels(results),
        }
        self._keep()
        return ""

    def page(self, notes: Mapping[str, str]) -> Path:
        """Write the page for the notebook.

        Raises:
            SceneError: it cannot be written.
        """
        from tactile_lab.errors import SceneError
        from tactile_lab.report.day_one import DayStep, write_day
        from tactile_lab.scene.load import load_bench
        from tactile_lab.whole_file import failing_as

        steps = [
            DayStep(
                title=step.title,
                name=step.name,
                when=found["at"],
                said=found["said"],
                printed=found.get("printed", ""),
                changes=found.get("changes", ()),
                run=found.get("run", ""),
            )
            for step in STEPS
            for found in (self.done[step.name],)
        ]
        page = self.out / PAGE
        with failing_as(f"{page} cannot be written", kind=SceneError):
            write_day(page, load_bench(self.bench), self.bench, steps, notes)
        return page

    def _calibrate(self, run: Path) -> None:
        """From now on the force rests on the calibration that `run` measured."""
        from tactile_lab.scene.load import load_bench
        from tactile_lab.scene.write_bench import write_calibrated_bench

        with refusing():
            target = self.out / BENCH
            spec = load_bench(self.bench)
            write_calibrated_bench(spec, run / "calibration.csv", target)
        self.bench = str(target.resolve())

    def _keep(self) -> None:
        from tactile_lab.store.folder import write_json

        with refusing():
            self.out.mkdir(parents=True, exist_ok=True)
            write_json(self.out / STATE, {"bench": self.bench, "done": self.done})


class _Tee(StringIO):
    """Keeps what is printed, and prints it."""

    def __init__(self) -> None:
        super().__init__()
        self._shown = sys.stdout

    def write(self, text: str, /) -> int:
        """Take a text."""
        self._shown.write(text)
        return super().write(text)


def _verb(words: list[str]) -> tuple[str, str]:
    """Call a verb of the command line: what it printed, and what it found wrong."""
    verbs = click.get_current_context().find_root().command
    with redirect_stdout(_Tee()) as printed:
        try:
            code = verbs.main(words, prog_name="tactile-lab", standalone_mode=False)
        except click.ClickException as refused:
            return printed.getvalue(), refused.format_message()
    return printed.getvalue(), f"it ended with {code}" if code else ""


def _absolute(bench: str) -> str:
    return bench if bench == "sim" else str(Path(bench).resolve())


def _ask(person: Callable[[str], str] | None, text: str) -> None:
    if person is None:
        warn(f"nobody is at the terminal to be told: {text}")
    else:
        person(text)


def _changes(overrides: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    from tactile_lab.errors import SceneError, choices

    found: dict[str, tuple[str, ...]] = {}
    runs = [step.name for step in STEPS if step.wrong is not None]
    for text in overrides:
        step, colon, change = text.partition(":")
        if not colon or step not in runs:
            known = choices(step, runs, "Steps")
            raise SceneError(f"--set {text}: write STEP:KEY=VALUE; {known}")
        found[step] = (*found.get(step, ()), change)
    return found


def _now() -> str:
    return f"{datetime.now():%Y-%m-%d %H:%M}"
