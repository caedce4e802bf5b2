"""Neurodata Without Borders, through pynwb; spike times in seconds."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError
from tactile_lab.signals import SIGNALS
from tactile_lab.spikes.detection import Detection
from tactile_lab.store.derived import DERIVED, derivation
from tactile_lab.store.export import packed
from tactile_lab.store.export.content import (
    ExportTable,
    about,
    changes,
    tables,
)
from tactile_lab.store.export.hdf5 import writing
from tactile_lab.store.export.library import library
from tactile_lab.store.folder import ZERO
from tactile_lab.store.progress import Progress, nothing
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.store.signal import StoredSignal
from tactile_lab.whole_file import replacing

UNITS = {
    "V": "volts",
    "A": "amperes",
    "T": "tesla",
    "K": "kelvins",
    "N": "newtons",
    "Hz": "hertz",
}
"""What NWB calls SI units."""

EVEN = 1e-3
"""Part of a step by which even steps may differ."""

CHUNK, AT_ONCE = 1 << 16, 1 << 20
"""Samples compressed together, and in memory at once."""

DOUBLE = 8
EMPTY = 250_000
"""Bytes of a file without data: the meaning of all that NWB knows is in each."""
SERIES = 5_000
"""Bytes of a series beside its data."""

READINGS = {
    "field": "teslameter readings",
    "temperature": "of the sensor",
}
"""Tables of one quantity against time."""

TABLES = {
    "spikes": "detected spikes",
    "current": "applied current, by when the source acted; `heard`: when the computer "
    "knew, with the force of that moment",
    "voltages": "what source meters held, read back",
    "events": "what happened",
    "remarks": "what people noted, also afterwards",
}
"""Tables that NWB has no place of its own for."""

TRIALS = {
    "label": "for people",
    "level": "force the trial is filed under",
    "hold_start": "start of the constant part",
    "hold_end": "its end",
    "spikes": "detected in it",
    "pause": "whether nothing was streamed",
    "complete": "whether it came to its end",
    "rest_V_C1": "V_C1 just before it",
    "drift_V_C1": "drift of that since the first trial",
}
"""Columns of trials beside those NWB has."""


def size(run: Run, selection: Selection) -> int:
    """Bytes the file will take, rather fewer, as stretches of it tell."""
    names = selection.names(run)
    stored = [run.signal(name) for name in names if name in run.signals]

    def pack(probe: Selection) -> int:
        memory = BytesIO()
        with h5py.File(memory, "w") as out:
            for signal in stored:
                parts = [signal.codes[first:stop] for first, stop in probe.spans(run)]
                codes = np.concatenate(parts)
                chunks = (min(CHUNK, codes.size),)
                out.create_dataset(
                    signal.name, data=codes, chunks=chunks, compression="gzip"
                )
        return memory.getbuffer().nbytes

    signals = packed.signals(run, selection, pack) if stored else 0
    series = len(stored) * len(selection.spans(run))
    if not run.gapless:
        signals += len(stored) * selection.rows(run) * DOUBLE
    for time in (_changes(run, n, selection) for n in names if n not in run.signals):
        signals += time.size * DOUBLE * (2 if "timestamps" in _times(time) else 1)
    return EMPTY + SERIES * series + signals + packed.listed(run, selection)


def export(
    run: Run,
    file: Path,
    selection: Selection,
    progress: Progress = nothing,
    room: int | None = None,
) -> list[Path]:
    """Write `file`: codes with conversion and offset, units table, trials, stimulus.

    `room` bytes must be free for it, as `size` tells unless given.

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
    room = size(run, selection) if room is None else room
    with (
        replacing(file, room) as part,
        writing(part, progress) as (disk, told),
        h5py.File(disk, "w") as out,
        pynwb.NWBHDF5IO(file=out, mode="w") as writer,
    ):
        writer.write(_filled(pynwb, run, selection, told))
    progress(1.0)
    return [file]


def _filled(pynwb: Any, run: Run, selection: Selection, progress: Progress) -> Any:
    """A session that holds the part; its samples are read as it is written."""
    session = _session(pynwb, run, about(run, selection))
    _add_signals(pynwb, session, run, selection, progress)
    _add_derived(pynwb, session, run, selection)
    found = tables(run, selection)
    _add_readings(pynwb, session, found)
    if trials := found.get("trials"):
        _add_trials(session, trials)
    for gap in selection.of(run.gaps):
        session.add_invalid_time_interval(
            start_time=float(gap["start"]), stop_time=float(gap["end"])
        )
    if run.detection is not None:
        _add_spikes(pynwb, session, run, selection, run.detection)
    return session


def _add_spikes(
    pynwb: Any, session: Any, run: Run, selection: Selection, detection: Detection
) -> None:
    """The train, and when it was listened to: where nothing was, is no silence.

    Without a spike no units: programs take an empty train for a damaged file.
    """
    axis, times = run.axis, selection.of(run.spikes)["time"]
    searched = [
        [axis.time_of(first), axis.time_of(stop - 1) + axis.step_at(first)]
        for first, stop in selection.spans(run)
    ]
    if not times.size:
        silent = pynwb.epoch.TimeIntervals(
            name="silence",
            description=f"{detection.signal} was listened to and had no spike",
        )
        for start, stop in searched:
            silent.add_interval(start_time=start, stop_time=stop)
        if searched:
            session.add_time_intervals(silent)
        return
    session.units = pynwb.misc.Units(
        name="units",
        description="detected spikes",
        resolution=float(run.attributes["interval"]),
    )
    session.add_unit_column("signal", "the channel the spikes were detected on")
    session.add_unit(
        spike_times=times,
        signal=detection.signal,
        **({"obs_intervals": searched} if searched else {}),
    )


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
        # all times in the file are from it on
        session_start_time=datetime.fromisoformat(
            run.info.get(ZERO) or run.info["started"]
        ),
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


def _add_signals(
    pynwb: Any, session: Any, run: Run, selection: Selection, progress: Progress
) -> None:
    """One series per signal and stream; where it has gaps, each sample has a time."""
    spans = selection.spans(run)
    if spans and not run.gapless:
        spans = [(spans[0][0], spans[-1][1])]
    stored = [name for name in selection.names(run) if name in run.signals]
    told = _Told(progress, len(stored) * sum(stop - first for first, stop in spans))
    digits = len(str(len(spans)))
    for name in stored:
        signal = run.signal(name)
        for number, (first, stop) in enumerate(spans, 1):
            title = name if len(spans) == 1 else f"{name}_{number:0{digits}}"
            times: dict[str, Any] = {
                "starting_time": float(run.axis.time_of(float(first))),
                "rate": 1.0 / run.axis.step_at(first),
            }
            if not run.gapless:
                times = {"timestamps": signal.time(first, stop)}
            session.add_acquisition(
                pynwb.TimeSeries(
                    name=title,
                    description=f"{signal.title}, scope input "
                    f"{signal.attributes.get('input')}",
                    data=pynwb.H5DataIO(
                        _streamed(signal, first, stop, told), compression="gzip"
                    ),
                    unit=UNITS.get(signal.unit, signal.unit),
                    conversion=signal.gain,
                    offset=signal.offset,
                    resolution=abs(signal.gain),
                    **times,
                )
            )


def _streamed(signal: StoredSignal, first: int, stop: int, told: _Told) -> Any:
    """Codes first to stop, read as they are written: a long run fills the memory."""
    iterator: Any = library("hdmf.data_utils", "pynwb").GenericDataChunkIterator
    length = stop - first

    class Codes(iterator):  # type: ignore[misc]
        def _get_data(self, selection: tuple[slice, ...]) -> Any:
            (part,) = selection
            told(part.stop - part.start)
            return signal.codes[first + part.start : first + part.stop]

        def _get_maxshape(self) -> tuple[int, ...]:
            return (length,)

        def _get_dtype(self) -> np.dtype[Any]:
            kind: np.dtype[Any] = signal.codes.dtype
            return kind

    return Codes(
        buffer_shape=(min(AT_ONCE, length),), chunk_shape=(min(CHUNK, length),)
    )


class _Told:
    """Tells how much of all samples is written."""

    def __init__(self, progress: Progress, whole: int) -> None:
        self._progress, self._whole, self._done = progress, whole, 0

    def __call__(self, more: int) -> None:
        self._done += more
        self._progress(self._done / self._whole)


def _add_derived(pynwb: Any, session: Any, run: Run, selection: Selection) -> None:
    """The force as a stimulus, I_DS and rate in a module of their own."""
    module = None
    for name in selection.names(run):
        if name in run.signals:
            continue
        time = _changes(run, name, selection)
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


def _changes(run: Run, name: str, selection: Selection) -> FloatArray:
    """Times that a derived signal is told at, s."""
    if name != "I_DS":
        return changes(run, name, selection)
    time = run.I_DS.time
    inside = time[selection.holds(time)]
    return inside if inside.size else np.array([selection.ends(run)[0]])


def _times(time: FloatArray) -> dict[str, Any]:
    """A start and a rate where times, s, are even; else each of them."""
    steps = np.diff(time)
    if steps.size > 1 and np.ptp(steps) < EVEN * steps.mean():
        return {"starting_time": float(time[0]), "rate": float(1 / steps.mean())}
    return {"timestamps": time}


def _add_readings(pynwb: Any, session: Any, found: dict[str, ExportTable]) -> None:
    """Applied current as stimulus, readings as acquisition; the tables themselves."""
    if current := found.get("current"):
        session.add_stimulus(
            pynwb.TimeSeries(
                name="applied_current",
                description="set-points of the coil's current source, by when it "
                "acted on them",
                data=current.columns["setpoint"],
                timestamps=current.columns["time"],
                unit="amperes",
                continuity="step",
            )
        )
    for name, what in READINGS.items():
        if table := found.get(name):
            session.add_acquisition(
                pynwb.TimeSeries(
                    name=name,
                    description=what,
                    data=table.columns[name],
                    timestamps=table.columns["time"],
                    unit=UNITS[table.units[name]],
                )
            )
    kept = [name for name in TABLES if name in found]
    if not kept:
        return
    module = session.create_processing_module(
        name="misc", description="what the run recorded beside its signals"
    )
    for name in kept:
        module.add(_table(pynwb, name, found[name]))


def _table(pynwb: Any, name: str, table: ExportTable) -> Any:
    columns = [
        # pynwb keeps "name" for the table's own
        pynwb.core.VectorData(
            name="voltage" if column == "name" else column,
            description=described,
            data=data,
        )
        for column, described, data in _known(table, {})
    ]
    return pynwb.core.DynamicTable(name=name, description=TABLES[name], columns=columns)


def _known(
    table: ExportTable, meanings: dict[str, str]
) -> Iterator[tuple[str, str, list[Any]]]:
    """Name, meaning with unit, and values of each column that says anything."""
    for name, values in table.columns.items():
        if values.dtype.kind == "f" and np.isnan(values).all():
            continue
        if values.dtype == np.uint8:
            values = values.astype(np.bool_)
        meaning, unit = meanings.get(name, name), table.units[name]
        yield name, f"{meaning}, {unit}" if unit else meaning, values.tolist()


def _add_trials(session: Any, table: ExportTable) -> None:
    known = {name: told for name, *told in _known(table, TRIALS)}
    native = [known.pop(name)[1] for name in ("index", "start", "end")]
    for name, (meaning, _) in known.items():
        session.add_trial_column(name, meaning)
    columns = (values for _, values in known.values())
    for number, start, end, *row in zip(*native, *columns, strict=True):
        found = dict(zip(known, row, strict=True))
        session.add_trial(id=number, start_time=start, stop_time=end, **found)
