"""``tactile-lab study``: one scene at many points, on every core."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactile_lab.commands.attended import INTERRUPTED, Signals, run_attended
from tactile_lab.commands.options import json_option, scheduler_option
from tactile_lab.commands.terminal import (
    ProgressLine,
    fail,
    print_json,
    refusing,
    say,
    warn,
    working,
)

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed
    from tactile_lab.engine.execution import Execution
    from tactile_lab.studies.carry_out import Forecast, StudyProgress
    from tactile_lab.studies.study import Study

UNSAFE = 4
"""Exit code where a coil's state could not be verified."""


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--plan", "only_plan", is_flag=True, help="Say what it will cost.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes on this machine; as many as cores unless given.",
)
@scheduler_option
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("studies"),
    show_default=True,
    metavar="DIR",
    help="Where studies and finished points are put.",
)
@json_option
def command(
    study: Path,
    only_plan: bool,
    workers: int | None,
    scheduler: str | None,
    out: Path,
    as_json: bool,
) -> None:
    """Carry out STUDY, a TOML file that says what of a scene varies.

    Interrupt it whenever you like: what was finished is kept, and the same command
    goes on. Points that were computed before are not computed again.
    """
    with refusing():
        from tactile_lab.studies.carry_out import forecast
        from tactile_lab.studies.study import load_study

        asked = load_study(study)
        if only_plan:
            with working("trying some points"):
                cost = forecast(asked, out)
            if as_json:
                print_json(_planned(asked, cost))
            else:
                _print_plan(asked, cost)
            return
        _carry_out(asked, out, workers, scheduler, as_json=as_json)


def _carry_out(
    study: Study,
    out: Path,
    workers: int | None,
    scheduler: str | None,
    *,
    as_json: bool,
) -> None:
    """Carry a study out, telling how far it is, and print what it says.

    Raises:
        TactileLabError: it cannot be carried out, or not to its end.
    """
    from tactile_lab.errors import UnsafeError
    from tactile_lab.studies.carry_out import carry_out
    from tactile_lab.studies.dataset import MADE_OF
    from tactile_lab.studies.live import SHOWN
    from tactile_lab.studies.page import REPORT, told_before, write_page

    folder = out / study.name
    if (told := told_before(study, folder)) is not None:
        text, *_ = (told.pop(key) for key in ("text", SHOWN, MADE_OF))
        if as_json:
            print_json({"study": str(folder), **told})
        else:
            say(f"Nothing to do: all points are known ({study.design.size:,}).")
            _say_all(text, folder, folder / REPORT)
        return
    ended: list[Executed] = []
    with ExitStack() as stack:
        line = stack.enter_context(ProgressLine(study.design.size, study.name))
        signals = stack.enter_context(Signals()) if study.on == "bench" else None

        def tell(progress: StudyProgress) -> None:
            line.update(progress.done, _now(progress))

        def play(execution: Execution) -> Executed:
            if signals is None:
                return execution.run()
            if signals.ending:  # it came as the run before was complete
                execution.folder.finish("aborted", reason="stopped before it began")
                raise KeyboardInterrupt
            ended.append(run_attended(execution, signals))
            signals.opened = False
            return ended[-1]

        try:
            found = carry_out(
                study, out, count=workers, scheduler=scheduler, tell=tell, play=play
            )
        except KeyboardInterrupt:
            line.close()
            coil = f" {ended[-1].off.text}" if ended else ""
            # a run that was complete already is no reason to say that all went well
            code = ended[-1].exit_code if ended else 0
            code = code or (signals.ending if signals else 0) or INTERRUPTED
            fail(f"interrupted; the same command goes on where it was.{coil}", code)
            return
        except UnsafeError as error:
            line.close()
            fail(str(error), UNSAFE)
            return
    with working("writing the report"):
        html, said = write_page(found, folder)
    for text in said.missing:
        warn(text)
    if as_json:
        print_json({"study": str(folder), **said.plain})
        return
    _say_all(said.text, folder, html)


def _say_all(text: str, folder: Path, report: Path) -> None:
    say(text)
    say()
    say(f"data    {folder / 'data.zarr'}")
    say(f"report  {report}")


def _now(progress: StudyProgress) -> str:
    parts = [f"{progress.done:,} of {progress.total:,} points"]
    if progress.there:
        parts.append(f"{progress.there:,} known before")
    if progress.failed:
        parts.append(f"{progress.failed:,} failed")
    if progress.workers > 1:
        parts.append(f"{progress.workers} workers")
    return ", ".join(parts)


def _print_plan(study: Study, cost: Forecast) -> None:
    from tactile_lab.studies.page import described

    design = study.design
    say(f"{study.title}: {study.scene.name} on {study.on}")
    say()
    for axis in design.axes:
        say(f"  {axis.key:<28} {described(axis)}")
    say(f"  {'kept':<28} {', '.join(one.name for one in study.kept)}")
    say()
    shape = " × ".join(map(str, design.shape)) or "1"
    say(f"points    {shape} = {design.size:,}, {cost.there:,} of them known")
    if cost.seconds is not None:
        left = cost.points - cost.there
        say(f"time      {_time(cost.seconds)} a point, {_time(cost.seconds * left)} on "
            f"one core; start and report take about {_time(cost.besides)} "
            "besides")  # fmt: skip
    if cost.reason:
        warn(f"a point that was tried failed: {cost.reason}")


def _planned(study: Study, cost: Forecast) -> dict[str, Any]:
    left = cost.points - cost.there
    return {
        "study": study.name,
        "points": cost.points,
        "known": cost.there,
        "seconds_a_point": cost.seconds,
        "seconds_on_one_core": None if cost.seconds is None else cost.seconds * left,
        "seconds_besides": cost.besides,
        "failed": cost.reason or None,
    }


def _time(seconds: float) -> str:
    from tactile_lab.quantity import show

    return show(seconds, "s", 2) if seconds < 120 else f"{seconds / 60:.0f} min"
