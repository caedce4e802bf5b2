"""Neurodata Without Borders, through pynwb; spike times in seconds."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError
from tactile_lab.signals import SIGNALS
from tactile_lab.store.derived import DERIVED, derivation
from tactile_lab.store.export.content import (
    about,
    dated_current,
    tables,
)
from tactile_lab.store.export.library import library
from tactile_lab.store.progress import Progress, nothing
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.whole_file import replacing

UNITS = {"V": "volts", "A": "amperes", "T": "tesla", "N": "newtons", "Hz": "hertz"}
"""What NWB calls SI units."""

EVEN = 1e-3
"""Part of a step by which even steps may differ."""

TRIALS = {
    "level": "force the trial is filed under, N",
    "label": "for people",
    "hold_start": "start of the constant part, s",
    "hold_end": "its end, s",
    "complete": "whether it came to its end, 1 or 0",
}
"""Columns of trials beside those NWB has."""


def size(run: Run, selection: Selection) -> int:
    """Bytes the file will take, at most."""
    stored = [run.signal(n) for n in selection.names(run) if n in run.signals]
    return sum(selection.rows(run) * int(s.codes.dtype.itemsize) for s in stored)


def export(
    run: Run, file: Path, selection: Selection, progress: Progress = nothing
) -> list[Path]:
    """Write `file`: codes with conversion and offset, units table, trials, stimulus.

    Raises:
        RunFolderError: pynwb is not installed, a rate was asked for, or a signal or
            time the run does not have.
        RecordingError: there is no room.
        OSError: the file cannot be written.
    """
    pynwb = library("pynwb")
    if selection.rate is not None:
        raise RunFolderError("NWB holds the samples as stored; leave out --rate.")
    selection.check(run)
    session = _session(pynwb, run, about(run, selection.names(run)))
    _add_signals(pynwb, session, run, selection)
    _add_derived(pynwb, session, run, selection)
    _add_readings(pynwb, session, run, selection)
    _add_trials(session, run)
    for gap in selection.of(run.gaps):
        session.add_invalid_time_interval(
            start_time=float(gap["start"]), stop_time=float(gap["end"])
        )
    if run.detection is not None:
        session.units = pynwb.misc.Units(
            name="units",
            description="detected spikes",
            resolution=float(run.attributes["interval"]),
        )
        session.add_unit_column("signal", "the channel the spikes were detected on")
        times = selection.of(run.spikes)["time"]
        session.add_unit(spike_times=times, signal=run.detection.signal)
    progress(0.5)
    with (
        replacing(file, size(run, selection)) as part,
        pynwb.NWBHDF5IO(str(part), "w") as writer,
    ):
        writer.write(session)
    progress(1.0)
    return [file]


def _session(pynwb: Any, run: Run, told: dict[str, str | float]) -> Any:
    """The file's head: what was done by whom, on what, with which instruments."""
    kind = "simulated" if run.simulated else "measured"
    notes = run.info.get("notes") or {}
    title = run.info.get("title") or run.info.get("protocol") or "run"
    scene = told.pop("scene.toml", None)
    session = pynwb.NWBFile(
        session_description=f"{title} on a spiking tactile sensor, {kind}",
        identifier=run.name,
        session_id=run.name,
        session_start_time=datetime.fromisoformat(run.info["started"]),
        experimenter=[_last_first(notes["operator"])]
        if notes.get("operator")
        else None,
        institution=notes.get("institution"),
        lab=notes.get("lab"),
        protocol=run.info.get("protocol"),
        experiment_description=run.info.get("scene"),
        notes="\n".join(f"{key}: {value}" for key, value in told.items()),
        source_script=scene,
        source_script_file_name=None if scene is None else "scene.toml",
        keywords=["tactile sensor", "spikes", kind],
    )
    session.subject = pynwb.file.Subject(
        subject_id=str(notes.get("sensor") or "sensor"),
        description="a piezoelectric tactile sensor; no animal was involved",
        species=notes.get("species"),
        sex="O",
        age="P0D",
    )
    for name, found in (run.info.get("instruments") or {}).items():
        settings = ", ".join(f"{key} {value}" for key, value in found.items())
        session.create_device(name=name, description=settings)
    return session


def _last_first(name: str) -> str:
    """A person as archives list them: "Petaru, A."."""
    *first, last = name.split()
    return name if "," in name or not first else f"{last}, {' '.join(first)}"


def _add_signals(pynwb: Any, session: Any, run: Run, selection: Selection) -> None:
    """One series per signal and stream; where it has gaps, each sample has a time."""
    spans = selection.spans(run)
    if spans and not run.gapless:
        spans = [(spans[0][0], spans[-1][1])]
    for name in selection.names(run):
        if name not in run.signals:
            continue
        signal = run.signal(name)
        for number, (first, stop) in enumerate(spans):
            title = name if len(spans) == 1 else f"{name}_{number + 1}"
            times: dict[str, Any] = {
                "starting_time": float(run.axis.time_of(float(first))),
                "rate": 1.0 / signal.interval,
            }
            if not run.gapless:
                times = {"timestamps": signal.time(first, stop)}
            session.add_acquisition(
                pynwb.TimeSeries(
                    name=title,
                    description=f"{signal.title}, scope input "
                    f"{signal.attributes.get('input')}",
                    data=pynwb.H5DataIO(signal.codes[first:stop], compression="gzip"),
                    unit=UNITS.get(signal.unit, signal.unit),
                    conversion=signal.gain,
                    offset=signal.offset,
                    resolution=abs(signal.gain),
                    **times,
                )
            )


def _add_derived(pynwb: Any, session: Any, run: Run, selection: Selection) -> None:
    """The force as a stimulus, I_DS and rate in a module of their own."""
    names, module = selection.names(run), None
    for name in (n for n in DERIVED if n in names):
        if name == "force":
            time = run.force.time
        elif name == "rate":
            time = run.rate["time"]
        else:
            time = run.I_DS.time
        end = np.inf if selection.end is None else selection.end
        time = time[(time >= selection.start) & (time < end)]
        if not time.size:
            continue
        series = pynwb.TimeSeries(
            name=name,
            description=f"{SIGNALS[name].title}, derived: {DERIVED[name]}",
            data=derivation(run, name)(time),
            unit=UNITS[SIGNALS[name].unit],
            continuity="step" if name == "rate" else "continuous",
            **_times(time),
        )
        if name == "force":
            session.add_stimulus(series)
            continue
        module = module or session.create_processing_module(
            name="ecephys", description="signals derived from those recorded"
        )
        module.add(series)


def _times(time: FloatArray) -> dict[str, Any]:
    """A start and a rate where times, s, are even; else each of them."""
    steps = np.diff(time)
    if steps.size and np.ptp(steps) < EVEN * steps.mean():
        return {"starting_time": float(time[0]), "rate": float(1 / steps.mean())}
    return {"timestamps": time}


def _add_readings(pynwb: Any, session: Any, run: Run, selection: Selection) -> None:
    """Applied current as stimulus, field readings as acquisition."""
    current, field = selection.of(dated_current(run)), selection.of(run.field)
    if current.size:
        session.add_stimulus(
            pynwb.TimeSeries(
                name="applied_current",
                description="set-points of the coil's current source, by when it "
                "acted on them",
                data=current["setpoint"],
                timestamps=current["time"],
                unit="amperes",
                continuity="step",
            )
        )
    if field.size:
        session.add_acquisition(
            pynwb.TimeSeries(
                name="field",
                description="teslameter readings",
                data=field["field"],
                timestamps=field["time"],
                unit="tesla",
            )
        )


def _add_trials(session: Any, run: Run) -> None:
    table = tables(run, Selection()).get("trials")
    if table is None:
        return
    for name, meaning in TRIALS.items():
        session.add_trial_column(name, meaning)
    columns = {name: table.columns[name].tolist() for name in ("start", "end", *TRIALS)}
    for row in zip(*columns.values(), strict=True):
        found = dict(zip(columns, row, strict=True))
        session.add_trial(
            start_time=found.pop("start"), stop_time=found.pop("end"), **found
        )
