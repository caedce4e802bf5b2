"""``tactile-lab day-one``: a lab's first hour with its bench, step by step."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass
from datetime import datetime
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactile_lab.commands.attended import INTERRUPTED, Signals
from tactile_lab.commands.one_run import finished, prepared, tell_of
from tactile_lab.commands.options import noted, notes_option
from tactile_lab.commands.terminal import fail, refusing, say, somebody, warn

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed

STATE, BENCH, PAGE = "day-one.json", "bench.toml", "day-one.html"
FIGURE, REPORT = "figure.png", "report.html"

Results = Mapping[str, Any]


def _wired(results: Results) -> str:
    channels = (results["conclusion"] or {}).get("channels") or {}
    wrong = [name for name, found in channels.items() if not found["ok"]]
    if not channels:
        return "no channel could be judged"
    return f"not as wired: {', '.join(wrong)}" if wrong else ""


def _calibrated(results: Results) -> str:
    found = (results["conclusion"] or {}).get("slope_T_per_A")
    return "" if found else "there is no calibration"


def _forced(results: Results) -> str:
    forces = (results["conclusion"] or {}).get("F_minus_F0_by_field_N") or [None]
    return "a force could not be told from the field" if None in forces else ""


def _onset(results: Results) -> str:
    found = (results["conclusion"] or {}).get("critical_force_N")
    return "" if found else "no critical force was found"


def _fired(results: Results) -> str:
    spikes = sum(trial["spikes"] for trial in results["trials"])
    return "" if spikes else "the sensor was silent"


@dataclass(frozen=True)
class Step:
    """One step of the first day.

    Attributes:
        name: of the scene that is run, or of the verb.
        title: for a person.
        before: what a person does first at a real bench; "" for nothing.
        see: what to see.
        otherwise: what to do if not.
        wrong: what is wrong with a run's results, "" if nothing; None for a verb.
        changes: of single keys of the scene.
    """

    name: str
    title: str
    see: str
    otherwise: str
    before: str = ""
    wrong: Callable[[Results], str] | None = None
    changes: tuple[str, ...] = ()


STEPS = (
    Step(
        "doctor",
        "Can this computer run an experiment?",
        "no problems; notes matter only for instruments you do not have.",
        "do what stands after `remedy`, then go on.",
    ),
    Step(
        "devices",
        "What is attached?",
        "each of your instruments, with the row or driver that fits it.",
        "check power and cable. An instrument without a row needs one "
        "(docs/how-to/add-a-dialect.md); on the simulated bench nothing need be here.",
    ),
    Step(
        "wiring_check",
        "Is each channel what the bench file says?",
        '"as wired" after each channel.',
        "the report names what is swapped, inverted, open or attenuated: mend the "
        "cable, or the channel in the bench file.",
        wrong=_wired,
    ),
    Step(
        "calibrate_field",
        "What field does the coil give?",
        "a slope near that of the bench file, a loop of a few mT, little drift.",
        "a slope of the other sign: turn the probe, or exchange the coil's leads. A "
        "wide loop: a core of hard steel. Drift: let coil and meter warm up.",
        before="Take the NdFeB magnet away and put the probe on the core's axis.",
        wrong=_calibrated,
    ),
    Step(
        "force_check",
        "Is the force what Eq. (2) says?",
        "the forces asked for, within their uncertainty. With a balance under the "
        "magnet note what it shows at each hold, and compare: tactile-lab run "
        "force_check --set 'protocol.readings=[\"50 mN\", ...]'.",
        "a tenth of the force: A2 as printed in Table 1. Otherwise check r, and that "
        "the magnet is back in its place.",
        before="Put the magnet back; without the sensor, or over a balance.",
        wrong=_forced,
    ),
    Step(
        "threshold_search",
        "Where does the sensor begin to fire?",
        "a critical force between two that were played.",
        "no spike at all: trim V_GS (tactile-lab monitor) until V_C1 rests a few 10 mV "
        "above the threshold. Spikes without force: V_GS is too high.",
        before="Put the sensor in its place.",
        wrong=_onset,
    ),
    Step(
        "demo",
        "Does it adapt?",
        "spikes that grow with the force and slow down within a hold.",
        "too small a force: take levels above the critical force that was found.",
        wrong=_fired,
    ),
)


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
                say(f"  $ tactile-lab run {step.name} --bench {day.bench}")
                with refusing():
                    scene = day.load(step, changes.get(step.name, ()))
                    run = prepared(scene, out / "runs", kept_notes)
                done = finished(run[0], signals, run[1])
                signals.opened = False
                if not tell_of(done, run[1], no_report=False):
                    fail("stopped while it told of the run", INTERRUPTED)
                wrong = day.ran(step, done)
            say(f"  to see: {step.see}")
            if wrong:
                say(f"  WRONG: {wrong}\n  what to do: {step.otherwise}")
                if step.wrong is not None:
                    again_command = f"tactile-lab day-one --out {out}"
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

    def load(self, step: Step, changes: tuple[str, ...]) -> Any:
        """The scene of a step on the bench as it is known now.

        Raises:
            SceneError: it cannot be used.
        """
        from tactile_lab.scene.load import load

        return load(step.name, (*step.changes, *changes), self.bench)

    def words(self, step: Step) -> tuple[str, ...]:
        """What a verb is told beside its name."""
        return ("--bench", self.bench) if step.name == "doctor" else ()

    def did(self, step: Step, printed: str, wrong: str) -> None:
        """A verb was called; what it printed is for a person to judge."""
        said = [wrong] if wrong else []
        self.done[step.name] = {"at": _now(), "said": said, "printed": printed}
        self._keep()

    def ran(self, step: Step, done: Executed) -> str:
        """A scene was run: what is wrong with it, "" if nothing."""
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
            "said": [*results["statements"], *results["missing"]] or _levels(results),
        }
        self._keep()
        return ""

    def page(self, notes: Mapping[str, str]) -> Path:
        """Write the page for the notebook.

        Args:
            notes: who and where.

        Raises:
            SceneError: it cannot be written.
        """
        from html import escape
        from urllib.parse import quote

        from tactile_lab.errors import SceneError
        from tactile_lab.notebook import facts
        from tactile_lab.scene.load import load_bench
        from tactile_lab.store.folder import replacing

        spec = load_bench(self.bench)
        kind = "simulated bench" if spec.simulated else "instruments"
        calibration = getattr(spec.magnet, "calibration", None)
        head = [
            ("Bench", f"{spec.name} ({kind}), {self.bench}"),
            ("Calibration", "" if calibration is None else calibration.path),
            *self._instruments(),
            *((name.capitalize(), value) for name, value in notes.items()),
            ("Written", _now()),
        ]
        parts = ["<h1>Day one</h1>", facts("The bench", head)]
        for number, step in enumerate(STEPS, 1):
            found = self.done[step.name]
            parts.append(f"<h2>{number}. {escape(step.title)}</h2>")
            run = found.get("run", "")
            where = [("When", found["at"]), ("Step", step.name), ("Run", run)]
            parts.append(facts("", where))
            if printed := found.get("printed"):
                parts.append(f"<pre>{escape(printed)}</pre>")
            parts += [f"<p>{escape(line)}</p>" for line in found["said"]]
            folder = quote(Path(run).as_posix())
            if run and (self.out / run / FIGURE).exists():
                parts.append(f'<p><img alt="{step.name}" src="{folder}/{FIGURE}"></p>')
            if run and (self.out / run / REPORT).exists():
                parts.append(f'<p><a href="{folder}/{REPORT}">report</a></p>')
        look = (
            "body{font-family:sans-serif;max-width:50em;margin:2em auto;padding:0 1em}"
            "th{vertical-align:top;padding-right:1em}img{max-width:100%}"
            "pre{overflow-x:auto;font-size:85%}"
        )
        page = self.out / PAGE
        try:
            with replacing(page) as new:
                new.write_text(
                    "<!doctype html><html><head><meta charset='utf-8'><title>Day one"
                    f"</title><style>{look}</style></head><body>{''.join(parts)}</body></html>\n",
                    encoding="utf-8",
                )
        except OSError as reason:
            raise SceneError(f"{page} cannot be written: {reason}.") from reason
        return page

    def _instruments(self) -> list[tuple[str, str]]:
        """What answered in any of the runs, by its role."""
        from tactile_lab.errors import RunFolderError
        from tactile_lab.store.folder import read_info

        found: dict[str, str] = {}
        for run in (
            self.out / one["run"] for one in self.done.values() if "run" in one
        ):
            with suppress(RunFolderError):
                for role, told in read_info(run).get("instruments", {}).items():
                    found[role.replace("_", " ").capitalize()] = told["identity"]
        return list(found.items())

    def _calibrate(self, run: Path) -> None:
        """From now on the force rests on the calibration that `run` measured."""
        from tactile_lab.scene.calibrated_bench import write_calibrated_bench
        from tactile_lab.scene.load import load_bench

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


class _Both(StringIO):
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
    with redirect_stdout(_Both()) as printed:
        try:
            code = verbs.main(words, prog_name="tactile-lab", standalone_mode=False)
        except click.ClickException as refused:
            return printed.getvalue(), refused.format_message()
    return printed.getvalue(), f"it ended with {code}" if code else ""


def _levels(results: Results) -> list[str]:
    """What each trial gave, of a run that says no more of it."""
    from tactile_lab.quantity import show

    told = []
    for trial in results["trials"]:
        text = f"{trial['label']}: {trial['spikes']} spikes"
        peak, final = trial["peak_rate_Hz"], trial["final_rate_Hz"]
        if peak is not None and final is not None:
            text += f", from {show(peak, 'Hz', 3)} down to {show(final, 'Hz', 3)}"
        told.append(f"{text} in the hold." if trial["spikes"] else f"{text}.")
    return told


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
