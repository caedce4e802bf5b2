"""The verbs of a script: plan, run and simulate a scene, and find its runs again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from tactile_lab.acquisition import events
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import ParameterError, RunFolderError, UnsafeError
from tactile_lab.model.circuit import Circuit
from tactile_lab.planning.plan import Plan
from tactile_lab.planning.plan import plan as plan_of
from tactile_lab.planning.timeline import timeline
from tactile_lab.scene.load import load
from tactile_lab.scene.overrides import Overrides
from tactile_lab.scene.scene import Scene
from tactile_lab.store.catalogue import Catalogue
from tactile_lab.store.run import Run
from tactile_lab.store.summary import RunSummary
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    import xarray

    from tactile_lab.model.simulate import Result
    from tactile_lab.report.identified import FittedRuns
    from tactile_lab.report.several import SeveralRuns
    from tactile_lab.report.write import Report
    from tactile_lab.studies.chosen import Chosen


def plan(
    scene: str | Path | Scene | None = None,
    overrides: Overrides = (),
    bench: str | Path | None = None,
) -> Plan:
    """What running a scene needs, leaves out and costs; opens nothing.

    Args:
        scene: as `load` takes it; the demo if None.
        overrides: changes of single keys, as `load` takes them.
        bench: path of a bench file, or "sim"; the scene's own if None.

    Raises:
        SceneError: the scene cannot be used, or not on its bench.
        LimitError: a force, the coil's heat or the sample rate lies beyond a limit.
    """
    return plan_of(load(scene, overrides, bench))


def run(
    scene: str | Path | Scene | None = None,
    overrides: Overrides = (),
    bench: str | Path | None = None,
    *,
    out: str | Path = "runs",
    realtime: bool = False,
    report: bool = True,
    notes: Mapping[str, str] | None = None,
    emit: events.Emit = events.ignore,
) -> Run:
    """Run a scene, store every sample, and give the run back.

    The coil is verified off and the record closed when this returns or raises. A
    scene reaches real instruments only through a bench file.

    Args:
        scene: as `load` takes it; the demo if None.
        overrides: changes of single keys, as `load` takes them.
        bench: path of a bench file, or "sim"; the scene's own if None.
        out: folder in which the run's own folder is made.
        realtime: pace a simulated bench by the clock.
        report: also write figure, report.html and results.json into the run's folder.
        notes: kept with the run, such as {"operator": "Ada"}.
        emit: told of everything that happens (`tactile_lab.acquisition.events`).

    Raises:
        SceneError, LimitError: refused before anything was opened.
        RecordingError: the folder cannot be written.
        UnsafeError: the coil's state could not be verified.
        TactileLabError: the run faulted. What was recorded until then is kept in the
            folder that the error's note names.
    """
    loaded = load(scene, overrides, bench)
    done = Execution(loaded, Path(out), realtime=realtime, emit=emit, notes=notes).run()
    kept = f"What was recorded is in {done.folder}."
    if not done.off.verified:
        raise UnsafeError(f"{done.off.text} {kept}") from done.failure
    if done.failure is not None:
        done.failure.add_note(kept)
        raise done.failure
    if report:
        write_report(done.folder)
    return Run.load(done.folder)


@overload
def write_report(  # type: ignore[overload-overlap]  # a str is a sequence of str, too
    run: Run | str | Path, out: str | Path | None = ..., *, pdf: bool = ...
) -> Report: ...
@overload
def write_report(
    run: Sequence[Run | str | Path], out: str | Path | None = ..., *, pdf: bool = ...
) -> SeveralRuns: ...
def write_report(
    run: Run | str | Path | Sequence[Run | str | Path],
    out: str | Path | None = None,
    *,
    pdf: bool = False,
) -> Report | SeveralRuns:
    """Write figure, report.html and results.json of a run, or one page of several.

    ``write_report(["runs/A", "runs/B"]).by_specimen``

    Args:
        run: a run, or its folder; or several, at least two.
        out: folder to write into; the run's own unless given, of several
            ./side-by-side.
        pdf: also write the figures as PDF.

    Raises:
        RunFolderError: not a run, or one without data.
        ParameterError: one of several is named twice.
        OSError: the folder cannot be written.
    """
    from tactile_lab.report.from_run import read
    from tactile_lab.report.write import write

    if isinstance(run, Run | str | Path):
        folder = _folder(run)
        into = folder if out is None else Path(out)
        into.mkdir(parents=True, exist_ok=True)
        return write(into, read(folder), pdf=pdf)
    from tactile_lab.report.several import SeveralRuns

    found = SeveralRuns.of([_folder(one) for one in run])
    found.write(Path("side-by-side" if out is None else out), pdf=pdf)
    return found


def _folder(run: Run | str | Path) -> Path:
    return run.path if isinstance(run, Run) else Path(run)


@overload
def simulate(
    what: Circuit,
    force: Waveform,
    *,
    keep: Sequence[str] = ...,
    tolerance: float = ...,
) -> Result: ...
@overload
def simulate(
    what: str | Path | Scene | None = ...,
    force: Overrides = ...,
    *,
    keep: Sequence[str] | None = ...,
    tolerance: float = ...,
) -> Result: ...
def simulate(
    what: Circuit | str | Path | Scene | None = None,
    force: Waveform | Overrides = (),
    *,
    keep: Sequence[str] | None = None,
    tolerance: float = 1e-9,
) -> Result:
    """The model alone, without a bench: spike times, and signals at any time.

    ``simulate(Circuit(V_GS=1.41), Waveform.pulse(0.15, ramp=0.01, hold=10.0))`` or
    ``simulate("demo", {"protocol.hold": "5 s"})``.

    Args:
        what: a circuit, or a scene as `load` takes it.
        force: on a circuit, N against s; for a scene, changes of single keys.
        keep: signals wanted, such as ("spikes", "V_C1"); what none of them needs is
            not computed. Spikes unless given, or what the scene records.
        tolerance: of spike times, s, and of V_C1, V.

    Raises:
        SceneError: the scene cannot be used.
        ParameterError: a parameter or the force lies outside the model's domain.
        SolverError: the model cannot answer to that tolerance.
    """
    if isinstance(what, Circuit):
        if not isinstance(force, Waveform):
            raise ParameterError(
                "A circuit is simulated under a Waveform, such as "
                "Waveform.pulse(0.15, ramp=0.01, hold=10.0)."
            )
        from tactile_lab.model import simulate as solver

        return solver.simulate(
            what, force, keep=keep or ("spikes",), tolerance=tolerance
        )
    if isinstance(force, Waveform):
        raise ParameterError(
            "A scene has a force of its own; give a Circuit with a Waveform, or a "
            "scene with changes of single keys."
        )
    from tactile_lab.planning.preview import model, modelled

    scene = load(what, force).sensor_alone
    drive = timeline(scene, through_coil=False)
    wanted = keep or modelled(scene)
    return model(scene, drive.force, drive.duration, wanted, tolerance)


def study(
    what: str | Path | Mapping[str, Any],
    *,
    name: str = "study",
    out: str | Path = "studies",
    workers: int | None = None,
    scheduler: str | None = None,
) -> xarray.Dataset:
    """Carry a study out: one scene at many points, labelled in one data set.

    ``study({"scene": "demo", "axis": [{"key": "sensor.R1", "normal": "1 %"}]})``

    Args:
        what: a study file, or what one would hold (docs/studies.md).
        name: of its folder, for one that is no file.
        out: holds the studies' folders and the points that were computed before.
        workers: processes on this machine; as many as cores unless given.
        scheduler: address of a Dask scheduler whose workers compute instead.

    Raises:
        SceneError: the study cannot be used as written.
        RecordingError: the folder cannot be written.
        NotFoundError: the scheduler does not answer.
    """
    from tactile_lab.studies.carry_out import carry_out
    from tactile_lab.studies.study import load_study

    asked = load_study(what, name)
    found = carry_out(asked, Path(out), count=workers, scheduler=scheduler)
    return found.to_xarray()


def identify(
    runs: Run | str | Path | Sequence[Run | str | Path],
    parameters: Sequence[str],
    *,
    force_scales: bool = False,
) -> FittedRuns:
    """Fit one set of parameters of the sensor to a run, or to several together.

    ``identify(["runs/A", "runs/B"], ["V_GS", "tau"]).together.estimates["V_GS"]``

    Args:
        runs: runs, or their folders.
        parameters: names of `Circuit`; the others stay as each run's scene has them.
        force_scales: fit a factor of each run's force as well, "force_1" and so on.

    Raises:
        RunFolderError: not a run, or one without data.
        NotIdentifiableError: the data do not determine a parameter.
        ParameterError: an unknown parameter.
    """
    from tactile_lab.report.from_run import read
    from tactile_lab.report.identified import identify_runs

    several = [runs] if isinstance(runs, Run | str | Path) else runs
    read_ = [read(_folder(one)) for one in several]
    return identify_runs(read_, parameters, force_scales=force_scales)


def design(what: str | Path | Mapping[str, Any]) -> Chosen:
    """Choose parts for a wanted behaviour, each want checked by the full solver.

    ``design({"want": {"threshold": {"is": "20 mN"}}}).values``

    Args:
        what: a specification, or what one would hold (docs/how-to/choose-parts.md).

    Raises:
        SceneError: the specification cannot be used as written.
    """
    from tactile_lab.studies.parts import choose
    from tactile_lab.studies.specification import load_specification

    return choose(load_specification(what))


def runs(out: str | Path = "runs", *, where: str = "") -> list[RunSummary]:
    """The runs in a folder, oldest first; each entry's `load()` opens its run.

    Args:
        out: holds run folders.
        where: a condition, such as "protocol.levels > 100 mN and tag = cal"
            (docs/how-to/find-and-compare-runs.md).

    Raises:
        RunFolderError: there is no such folder.
        SceneError: `where` cannot be read.
    """
    with Catalogue(Path(out)) as found:
        return found.runs(where=where)


def latest(out: str | Path = "runs", *, where: str = "") -> Run:
    """The newest run in a folder that can be read.

    Args:
        out: holds run folders.
        where: a condition as `runs` takes it, such as "protocol = hold".

    Raises:
        RunFolderError: there is no such folder, or no such run in it.
        SceneError: `where` cannot be read.
    """
    for entry in reversed(runs(out, where=where)):
        try:
            return entry.load()
        except RunFolderError:
            continue  # it ended before its first sample
    what = f"run with {where}" if where else "run"
    raise RunFolderError(f"{Path(out).resolve()} holds no {what} that can be read.")
